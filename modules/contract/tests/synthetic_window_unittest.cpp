#include "etalon/contract/synthetic_window.h"

#include <gtest/gtest.h>

#include <vector>

#include "etalon/core/so3.h"

namespace etalon::testing {
namespace {

using Eigen::Vector3d;

TEST(SyntheticWindow, AWorldThatIsTurnedAndMovedChangesNoMeasurement) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  const SyntheticWindow here = makeSyntheticWindow(options);
  options.world_yaw_rad = 2.0;
  options.world_origin = {10.0, -20.0, 5.0};
  const SyntheticWindow there = makeSyntheticWindow(options);
  ASSERT_EQ(here.frames[4].observations.size(), there.frames[4].observations.size());
  for (size_t i = 0; i < here.frames[4].observations.size(); ++i)
    EXPECT_LT((here.frames[4].observations[i].left - there.frames[4].observations[i].left).norm(),
              1e-7);
  EXPECT_LT((here.imu.samples()[9].accel - there.imu.samples()[9].accel).norm(), 1e-9);
  EXPECT_GT((here.truth[0].T_WB.t - there.truth[0].T_WB.t).norm(), 5.0);
  // Errors are counted after alignment in yaw and position.
  const WindowErrors errors = errorsOf(there.truth, there.bias, here);
  EXPECT_LT(errors.ate_m, 1e-9);
  EXPECT_LT(errors.velocity_mps, 1e-9);
  EXPECT_LT(errors.gravity_deg, 1e-5);
}

TEST(SyntheticWindow, ErrorsAreInTheUnitsThatTheyName) {
  const SyntheticWindow window = makeSyntheticWindow({});
  std::vector<StampedState> states = window.truth;
  const Eigen::Matrix3d tilt = expSO3({M_PI / 180.0, 0, 0});
  for (StampedState& s : states) s.T_WB.R = tilt * s.T_WB.R;
  EXPECT_NEAR(errorsOf(states, window.bias, window).gravity_deg, 1.0, 1e-6);
  EXPECT_LT(errorsOf(states, window.bias, window).rre_deg, 1e-5);  // a common turn is no RRE
  states = window.truth;
  for (StampedState& s : states) s.v_WB += s.T_WB.R * Vector3d(0.3, 0.0, 0.4);
  EXPECT_NEAR(errorsOf(states, window.bias, window).velocity_mps, 0.5, 1e-9);
  ImuBias bias = window.bias;
  bias.gyro += Vector3d(0.0, 3e-3, 4e-3);
  bias.accel += Vector3d(0.6, 0.0, 0.8);
  const WindowErrors off = errorsOf(window.truth, bias, window);
  EXPECT_NEAR(off.gyro_bias_rps, 5e-3, 1e-12);
  EXPECT_NEAR(off.accel_bias_mps2, 1.0, 1e-12);
}

}  // namespace
}  // namespace etalon::testing
