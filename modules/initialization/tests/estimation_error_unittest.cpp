#include "etalon/initialization/estimation_error.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

TEST(EstimationError, TakesYawOutAndTiltAboutTheWorldsAxes) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const Eigen::Vector3d tilt(0.01, -0.02, 0.0), dv(0.1, 0.2, -0.3);
  const Eigen::Matrix3d yaw = expSO3({0.0, 0.0, 2.5});
  Initialization result;
  result.states = window.truth;
  for (StampedState& s : result.states) {
    s.T_WB.R = expSO3(tilt) * yaw * s.T_WB.R;
    s.v_WB = yaw * s.v_WB + dv;
  }
  result.bias.gyro = {1e-3, 2e-3, 3e-3};
  const Eigen::Matrix<double, 11, 1> error = estimationError(result, window);
  Eigen::Matrix<double, 11, 1> expected;
  expected << 1e-3, 2e-3, 3e-3, 0, 0, 0, tilt.head<2>(), dv;
  EXPECT_LT((error - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace etalon
