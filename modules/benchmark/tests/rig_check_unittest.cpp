#include "../benchmarks/rig_check.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;

/** Tracks of 0.2 px seen by EuRoC's rig, in flight. */
SyntheticWindow flight() {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.sigma_px = 0.2;
  return testing::makeSyntheticWindow(options);
}

RigCheck check(const SyntheticWindow& window, const StereoInertialCalibration& believed) {
  std::vector<SE3> T_WB;
  for (const StampedState& state : window.truth) T_WB.push_back(state.T_WB);
  return checkRig(believed, window.keyframes(), T_WB);
}

const RigParameter& find(const RigCheck& check, const std::string& name) {
  const auto found = std::find_if(check.parameters.begin(), check.parameters.end(),
                                  [&](const RigParameter& p) { return p.name == name; });
  EXPECT_NE(found, check.parameters.end()) << name;
  return *found;
}

TEST(RigCheck, ARightCalibrationIsLeftAsItIs) {
  const SyntheticWindow window = flight();
  const RigCheck result = check(window, window.calibration);
  // One of eleven parameters exceeds 4 sigma by chance once in 1,400.
  for (const RigParameter& p : result.parameters)
    EXPECT_LT(std::abs(p.correction), 4.0 * p.sigma) << p.name;
  EXPECT_NEAR(result.rms_px, 0.2, 0.02);  // less the landmarks' and poses' freedom
}

TEST(RigCheck, FindsATurnedCameraAndAWrongFocalLengthButKeepsTheBaseline) {
  const SyntheticWindow window = flight();
  StereoInertialCalibration believed = window.calibration;
  constexpr double kTurned = 1.0, kLonger = 1.5;  // mrad about y; thousandths
  believed.cameras[1].T_BC.R =
      believed.cameras[1].T_BC.R * expSO3(Eigen::Vector3d(0.0, kTurned / 1e3, 0.0));
  for (const char* name : {"fu", "fv"}) {
    CameraModel& right = believed.cameras[1].model;
    right = right.with(name, right.parameter(name) * (1.0 + kLonger / 1e3));
  }
  const RigCheck result = check(window, believed);
  // The correction undoes the turn by w: T_C1C0 is multiplied by Exp(w) from the left.
  const RigParameter& turn = find(result, "right camera turned about y");
  const RigParameter& focal = find(result, "focal length, right camera less left");
  // One linear step with the outliers of the wrong calibration may be a tenth too short.
  EXPECT_NEAR(turn.correction, kTurned, 4.0 * turn.sigma + 0.1 * kTurned);
  EXPECT_NEAR(focal.correction, -kLonger, 4.0 * focal.sigma + 0.1 * kLonger);
  EXPECT_LT(turn.sigma, 0.25 * kTurned);
  EXPECT_LT(focal.sigma, 0.25 * kLonger);
  EXPECT_LT(result.rms_px_corrected, result.rms_px);
  EXPECT_NEAR(result.corrected.baseline(), believed.baseline(), 1e-12);
}

}  // namespace
}  // namespace etalon
