#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "joint_case.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kKeyframes = 12;

/**
 * Geometric means of the estimated sizes in windows whose errors are `truth` times as large as
 * believed.
 * @param spread of the slow error and the white noise
 */
AccelErrorSizes estimatedSizes(const AccelErrorSizes& truth, double spread, double jolt_spread) {
  JointModel model;
  model.slow_accel = {0.02, 0.4};
  model.slow_accel.spread = model.slow_accel.white_spread = spread;
  model.slow_accel.jolt_spread = jolt_spread;
  JointCase c(kKeyframes, model.slow_accel);
  Vector12 x;
  x << c.estimate.T_VB[0].R.transpose() * c.window.truth[0].v_WB, VectorXd::Zero(6),
      c.window.truth[0].T_WB.R.transpose() * Vector3d(0.0, 0.0, -9.81);
  const Index n = c.S.rows();
  c.S = MatrixXd::Identity(n, n) * 1e9;  // poses to 0.03 mm and 0.002 deg
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  constexpr int kWindows = 60, kPasses = 6;
  const std::vector<Preintegration> imu = c.problem.preintegrate(c.window.bias);
  const auto composed = [&](const AccelErrorSizes& sizes) {
    SlowAcceleration slow = model.slow_accel;
    slow.sigma_mps2 *= sizes.slow;
    return composeMotion(imu, slow, sizes.whiteByInterval());
  };
  c.motion = composed(truth);
  const MatrixXd root = c.imuCovariance().llt().matrixL();
  VectorXd logarithm = VectorXd::Zero(2 + truth.jolts.size());  // [slow, white, jolts]
  for (int window = 0; window < kWindows; ++window) {
    const VectorXd y = c.carried(x) + root * VectorXd::NullaryExpr(n, draw);
    c.s = c.S * y + c.S.llt().matrixL() * VectorXd::NullaryExpr(n, draw);
    JointEstimate solved = c.estimate;
    solved.sizes = AccelErrorSizes(truth.jolts.size());
    for (int pass = 0; pass < kPasses; ++pass) {
      const JointSystem system(c.problem, composed(solved.sizes), c.S, c.s, c.estimate, model);
      EXPECT_TRUE(system.solve(&solved));
    }
    VectorXd found(logarithm.size());
    found << solved.sizes.slow, solved.sizes.white, solved.sizes.jolts;
    logarithm += found.array().log().matrix() / kWindows;
  }
  AccelErrorSizes mean;
  mean.slow = std::exp(logarithm(0));
  mean.white = std::exp(logarithm(1));
  mean.jolts = logarithm.tail(truth.jolts.size()).array().exp();
  return mean;
}

/** The sizes stay where they are believed if that is right; elsewhere they go most of the way. */
TEST(JointSystem, FindsTheSizesOfTheAccelerometersErrorsInTheWindow) {
  const double twice = std::pow(2.0, 0.8);
  const auto expectSizes = [](double slow, double white, double spread, double expected_slow,
                              double expected_white) {
    AccelErrorSizes truth(kKeyframes - 1);
    truth.slow = slow;
    truth.white = white;
    const AccelErrorSizes found = estimatedSizes(truth, spread, 0.0);
    EXPECT_NEAR(std::log(found.slow / expected_slow), 0.0, 0.15);
    EXPECT_NEAR(std::log(found.white / expected_white), 0.0, 0.15);
  };
  expectSizes(2.0, 2.0, 0.0, 1.0, 1.0);  // not asked
  expectSizes(1.0, 1.0, 1.0, 1.0, 1.0);
  expectSizes(2.0, 1.0, 1.0, twice, 1.0);
  expectSizes(1.0, 2.0, 1.0, 1.0, twice);
}

TEST(JointSystem, FindsTheIntervalWithAJolt) {
  constexpr Index kJolted = 6;
  AccelErrorSizes truth(kKeyframes - 1);
  truth.jolts(kJolted) = 8.0;
  const AccelErrorSizes found = estimatedSizes(truth, 0.5, 2.0);
  EXPECT_GT(found.jolts(kJolted), 4.0);
  EXPECT_NEAR(found.slow, 1.0, 0.2);
  EXPECT_NEAR(found.white, 1.0, 0.2);
  Eigen::VectorXd others = found.jolts;
  others(kJolted) = 1.0;
  EXPECT_LT(others.maxCoeff(), 1.5);
}

}  // namespace
}  // namespace etalon
