#include "residuals/preintegration_cost.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::expectJacobians;
using testing::kAttitudes;
using testing::kPosition;
using testing::poseValue;
using testing::residual;
using testing::Values;

TEST(PreintegrationCost, JacobiansAgreeWithDifferencesAndAreWhitened) {
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  std::vector<ImuSample> samples;
  for (int k = 0; k <= 50; ++k) {
    const double t = 0.005 * k;
    ImuSample s;
    s.t = durationNs(t);
    s.gyro = Vector3d(std::sin(2 * t), 0.7 * std::cos(3 * t), -0.9 + 0.2 * t);
    s.accel = Vector3d(std::cos(t), 1.5 * std::sin(4 * t), 9.5 + std::sin(2 * t));
    samples.push_back(s);
  }
  const Preintegration p(samples, {{0.01, -0.02, 0.03}, {0.05, 0.1, -0.1}}, calibration.imu.noise);
  const Vector3d g_W(0, 0, -9.81), v_i(0.8, -1.2, 0.3), v_j(0.6, -1.0, 0.1);
  VectorXd bias(6);
  bias << 0.3, -0.2, 0.1, 0.5, -0.5, 0.2;
  for (const Vector3d& attitude : kAttitudes) {
    const SE3 T_i(expSO3(attitude), kPosition);
    const SE3 T_j(T_i.R * p.deltas().dR * expSO3({0.3, 0.2, -0.4}), kPosition + 0.2 * v_i);
    const PreintegrationCost cost(p, g_W);
    const Values values = {poseValue(T_i), v_i, poseValue(T_j), v_j, bias};
    expectJacobians(cost, values);
    // The squared norm is that by the covariance, whatever root of it whitens.
    const Eigen::Matrix<double, 9, 1> r =
        preintegrationResidual(p, T_i, v_i, T_j, v_j, {bias.head<3>(), bias.tail<3>()}, g_W);
    const double expected = r.dot(p.covariance9().fullPivLu().solve(r));
    EXPECT_NEAR(residual(cost, values).squaredNorm(), expected, 1e-9 * expected);
    // The modes of a slow error add to b_a.
    VectorXd modes(6), moved = bias;
    modes << 1.0, -2.0, 0.5, 0.3, 0.7, -0.4;
    const Eigen::Vector2d slow(0.1, -0.05);
    const PreintegrationCost with_modes(p, g_W, slow);
    Values more = values;
    more.push_back(modes);
    expectJacobians(with_modes, more);
    moved.tail<3>() += 0.1 * modes.head<3>() - 0.05 * modes.tail<3>();
    const VectorXd as_bias = residual(cost, {poseValue(T_i), v_i, poseValue(T_j), v_j, moved});
    EXPECT_LT((residual(with_modes, more) - as_bias).norm(), 1e-9 * as_bias.norm());
  }
}

}  // namespace
}  // namespace etalon
