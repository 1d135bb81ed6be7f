#include "residuals/inertial_cost.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::expectJacobians;
using testing::kAttitudes;
using testing::kPosition;
using testing::poseValue;
using testing::residual;
using testing::Values;

TEST(InertialCost, JacobiansAgreeWithDifferencesAndAreWhitened) {
  std::vector<ImuSample> samples;
  for (int k = 0; k <= 50; ++k) {
    const double t = 0.005 * k;
    ImuSample s;
    s.t = durationNs(t);
    s.gyro = Vector3d(std::sin(2 * t), 0.7 * std::cos(3 * t), -0.9 + 0.2 * t);
    s.accel = Vector3d(std::cos(t), 1.5 * std::sin(4 * t), 9.5 + std::sin(2 * t));
    samples.push_back(s);
  }
  const Preintegration p(samples, {{0.01, -0.02, 0.03}, {0.05, 0.1, -0.1}}, ImuNoiseDensities());
  const Vector3d g_W(0, 0, -9.81);
  for (const Vector3d& attitude : kAttitudes) {
    NavState a, b;
    a.T_WB = SE3(expSO3(attitude), kPosition);
    a.v_WB = {0.8, -1.2, 0.3};
    a.bias = {{0.3, -0.2, 0.1}, {0.5, -0.5, 0.2}};
    b.T_WB = SE3(a.T_WB.R * p.deltas().dR * expSO3({0.3, 0.2, -0.4}), kPosition + 0.2 * a.v_WB);
    b.v_WB = {0.6, -1.0, 0.1};
    b.bias = {{0.31, -0.2, 0.12}, {0.4, -0.5, 0.1}};
    const InertialCost cost(p, g_W);
    const auto motion = [](const NavState& state) {
      const MotionBlock block = toMotionBlock(state);
      return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(block.data(), 9));
    };
    const Values values = {poseValue(a.T_WB), motion(a), poseValue(b.T_WB), motion(b)};
    expectJacobians(cost, values);
    // The squared norm is that by the covariance, whatever root of it whitens.
    const Eigen::Matrix<double, 15, 1> r = inertialResidual(p, a, b, g_W);
    const double expected = r.dot(p.covariance().fullPivLu().solve(r));
    EXPECT_NEAR(residual(cost, values).squaredNorm(), expected, 1e-6 * expected);
  }
}

}  // namespace
}  // namespace etalon
