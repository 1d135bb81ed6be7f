#include "etalon/initialization/joint/joint_system.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector12 = Eigen::Matrix<double, 12, 1>;  // [v_0, b_g, b_a, g]

/** Keyframes at their true poses. What the tracks say of the poses, S and s, is drawn. */
struct JointCase {
  explicit JointCase(int keyframes = 4, const SlowAcceleration& slow = {})
      : problem(contractProblem(keyframes, slow)), estimate(trueEstimate()) {
    motion = composeMotion(problem.preintegrate(estimate.bias), slow);
    const Index n = 6 * (problem.keyframeCount() - 1);
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto draw = [&] { return normal(random); };
    const MatrixXd A = MatrixXd::NullaryExpr(n, n, draw);
    S = 1e5 * (A * A.transpose() + MatrixXd::Identity(n, n));
    // The cameras see the poses a centimetre and some hundredths of a radian elsewhere.
    s = S * (0.01 * VectorXd::NullaryExpr(n, draw));
  }

  InitializationProblem contractProblem(int keyframes, const SlowAcceleration& slow) {
    testing::SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.keyframes = keyframes;
    options.landmarks = 20;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    options.priors = {options.bias, 0.1, 0.1, slow};
    options.priors.mean.accel.x() += 0.05;
    window = testing::makeSyntheticWindow(options);
    return testing::makeProblem(window, options);
  }
  JointEstimate trueEstimate() const {
    JointEstimate result;
    result.bias = window.bias;
    for (const StampedState& state : window.truth)
      result.T_VB.push_back(window.truth[0].T_WB.inverse() * state.T_WB);
    result.T_SS = result.T_VB;
    return result;
  }

  /** Where the IMU carries the nodes from x, less the estimate's poses: 6 a node. */
  VectorXd carried(const Vector12& x) const {
    VectorXd y(S.rows());
    for (size_t k = 1; k < motion.nodes.size(); ++k) {
      const ClosedFormMotion::Node& node = motion.nodes[k];
      const Eigen::Matrix<double, 9, 1> by_bias = node.bias * x.segment<6>(3);
      y.segment<3>(6 * (k - 1)) =
          logSO3(estimate.T_VB[k].R.transpose() * node.R_VB) + by_bias.head<3>();
      y.segment<3>(6 * (k - 1) + 3) = node.alpha + node.t * x.head<3>() +
                                      0.5 * node.t * node.t * x.tail<3>() + by_bias.segment<3>(3) -
                                      estimate.T_VB[k].t;
    }
    return y;
  }
  /** Sigma: of the nodes' poses. */
  MatrixXd imuCovariance() const {
    MatrixXd result(S.rows(), S.rows());
    for (Index i = 0; i < S.rows() / 6; ++i)
      for (Index j = 0; j < S.rows() / 6; ++j)
        result.block<6, 6>(6 * i, 6 * j) = motion.covariance.block<6, 6>(9 * i, 9 * j);
    return result;
  }
  /** The cost as the class states it, by inverting what the class never inverts. */
  double cost(const Vector12& x) const {
    const MatrixXd S_inverse = S.inverse();
    const VectorXd r = carried(x) - S_inverse * s;
    const BiasPriors& priors = problem.priors();
    const Vector3d gyro = estimate.bias.gyro + x.segment<3>(3) - priors.mean.gyro;
    const Vector3d accel = estimate.bias.accel + x.segment<3>(6) - priors.mean.accel;
    return r.dot((S_inverse + imuCovariance()).inverse() * r) +
           gyro.squaredNorm() / std::pow(priors.sigma_gyro_rps, 2) +
           accel.squaredNorm() / std::pow(priors.sigma_accel_mps2, 2);
  }

  testing::SyntheticWindow window;
  InitializationProblem problem;
  JointEstimate estimate;
  ClosedFormMotion motion;
  MatrixXd S;
  VectorXd s;
};

Vector12 unknowns(const JointEstimate& before, const JointEstimate& after) {
  Vector12 x;
  x << after.v_VB[0], after.bias.gyro - before.bias.gyro, after.bias.accel - before.bias.accel,
      after.g_V;
  return x;
}

/** Moves x by [v_0, b_g, b_a] and gravity along its sphere: 11 degrees of freedom. */
Vector12 moved(const Vector12& x, const VectorXd& by) {
  Vector12 result = x;
  result.head<9>() += by.head<9>();
  const Vector3d g = x.tail<3>() + 9.81 * tangentBasis(x.tail<3>()) * by.tail<2>();
  result.tail<3>() = 9.81 * g.normalized();
  return result;
}

TEST(JointSystem, FindsTheMinimumOfItsCost) {
  const JointCase c;
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(JointSystem(c.problem, c.motion, c.S, c.s, c.estimate, {}).solve(&solved));
  const Vector12 x = unknowns(c.estimate, solved);
  EXPECT_NEAR(x.tail<3>().norm(), 9.81, 1e-9);
  const double least = c.cost(x);
  // A step that is uphill in both directions of every axis, with a gradient that is nothing beside
  // the curvature.
  for (Index axis = 0; axis < 11; ++axis) {
    const VectorXd step = 1e-4 * VectorXd::Unit(11, axis);
    const double up = c.cost(moved(x, step)) - least, down = c.cost(moved(x, -step)) - least;
    EXPECT_GT(up, 0.0);
    EXPECT_GT(down, 0.0);
    EXPECT_NEAR(up, down, 1e-3 * (up + down)) << "axis " << axis;
  }
}

/** n is what is most likely: the mean of the IMU's prediction and the tracks, each by its worth. */
TEST(JointSystem, PosesLieBetweenTheImuAndTheTracks) {
  const JointCase c;
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(JointSystem(c.problem, c.motion, c.S, c.s, c.estimate, {}).solve(&solved));
  const VectorXd y = c.carried(unknowns(c.estimate, solved));
  const MatrixXd imu = c.imuCovariance().inverse();
  const VectorXd expected = (imu + c.S).inverse() * (imu * y + c.s);
  for (size_t k = 1; k < solved.T_VB.size(); ++k) {
    const SE3 &before = c.estimate.T_VB[k], &after = solved.T_VB[k];
    EXPECT_LT((logSO3(before.R.transpose() * after.R) - expected.segment<3>(6 * k - 6)).norm(),
              1e-8);
    EXPECT_LT((after.t - before.t - expected.segment<3>(6 * k - 3)).norm(), 1e-8);
  }
}

/** Half the second derivative of the cost is the information on [v_0, b_g, b_a, tilt]. */
TEST(JointSystem, BiasCovarianceIsTheInverseOfTheCurvature) {
  const JointCase c;
  const JointSystem system(c.problem, c.motion, c.S, c.s, c.estimate, {});
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(system.solve(&solved));
  const Vector12 x = unknowns(c.estimate, solved);
  const auto r = [&](Index i, Index j) {
    const double h = 1e-3;
    const VectorXd a = h * VectorXd::Unit(11, i), b = h * VectorXd::Unit(11, j);
    // Along straight lines, as the tangent plane has them.
    const auto at = [&](const VectorXd& by) {
      Vector12 p = x;
      p.head<9>() += by.head<9>();
      p.tail<3>() += 9.81 * tangentBasis(x.tail<3>()) * by.tail<2>();
      return c.cost(p);
    };
    return (at(a + b) - at(a - b) - at(b - a) + at(-a - b)) / (8.0 * h * h);
  };
  const MatrixXd information = MatrixXd::NullaryExpr(11, 11, r);
  const MatrixXd expected = information.inverse().block<6, 6>(3, 3);
  const MatrixXd covariance = system.covariance(solved, {});
  ASSERT_EQ(covariance.rows(), 11);
  EXPECT_LT((covariance.topLeftCorner<6, 6>() - expected).norm(), 1e-3 * expected.norm());
}

/** The inverse of the whole information on [v_0, b_g, b_a, tilt] and the poses y = J x + n. */
MatrixXd inverseOfAll(const JointCase& c, const JointEstimate& solved) {
  const Vector12 x = unknowns(c.estimate, solved);
  const Index n = c.S.rows();
  MatrixXd J(n, 11);
  for (Index i = 0; i < 11; ++i) {
    const VectorXd step = 1e-4 * VectorXd::Unit(11, i);
    J.col(i) = (c.carried(moved(x, step)) - c.carried(moved(x, -step))) / 2e-4;
  }
  const MatrixXd imu = c.imuCovariance().inverse();
  MatrixXd information(11 + n, 11 + n);
  information << J.transpose() * imu * J, -J.transpose() * imu, -imu * J, imu + c.S;
  const BiasPriors& priors = c.problem.priors();
  information.diagonal().segment<3>(3).array() += std::pow(priors.sigma_gyro_rps, -2.0);
  information.diagonal().segment<3>(6).array() += std::pow(priors.sigma_accel_mps2, -2.0);
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  return scale.asDiagonal() *
         MatrixXd((scale.asDiagonal() * information * scale.asDiagonal()).inverse()) *
         scale.asDiagonal();
}

std::vector<size_t> allKeyframes(const JointCase& c) {
  std::vector<size_t> keyframes(c.estimate.T_VB.size());
  std::iota(keyframes.begin(), keyframes.end(), 0);
  return keyframes;
}

/** Poses and gyro bias of a covariance against an expected one, as correlations: J is a difference
 * quotient. */
void expectPosesAndGyroBias(const MatrixXd& covariance, const MatrixXd& expected) {
  const Index n = expected.rows() - 11;
  ASSERT_EQ(covariance.rows(), 11 + n);
  const VectorXd sigma = covariance.diagonal().cwiseSqrt().tail(n);
  const MatrixXd difference = covariance.bottomRightCorner(n, n) - expected.bottomRightCorner(n, n);
  EXPECT_LT((sigma.cwiseInverse().asDiagonal() * difference * sigma.cwiseInverse().asDiagonal())
                .cwiseAbs()
                .maxCoeff(),
            1e-3);
  EXPECT_LT((covariance.block(0, 11, 3, n) - expected.block(3, 11, 3, n)).norm(),
            1e-3 * expected.block(3, 11, 3, n).norm());
}

TEST(JointSystem, PoseCovarianceIsThatOfUnknownsAndPosesTogether) {
  const JointCase c;
  const JointSystem system(c.problem, c.motion, c.S, c.s, c.estimate, {});
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(system.solve(&solved));
  expectPosesAndGyroBias(system.covariance(solved, allKeyframes(c)), inverseOfAll(c, solved));
}

/** A gradient that is noisier than the curvature says makes the error A^-1 B A^-1. */
TEST(JointSystem, ExcessOfTheScoreIsBetweenTwoInverses) {
  const JointCase c;
  const JointSystem system(c.problem, c.motion, c.S, c.s, c.estimate, {});
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(system.solve(&solved));
  const Index n = c.S.rows();
  const MatrixXd excess = 0.5 * c.S;
  const MatrixXd inverse = inverseOfAll(c, solved);
  const MatrixXd expected = inverse + inverse.rightCols(n) * excess * inverse.bottomRows(n);
  expectPosesAndGyroBias(system.covariance(solved, allKeyframes(c), excess), expected);
}

constexpr Index kSizesKeyframes = 12;

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
  JointCase c(kSizesKeyframes, model.slow_accel);
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
  AccelErrorSizes logarithm(truth.jolts.size());
  logarithm.slow = logarithm.white = 0.0;
  logarithm.jolts.setZero();
  for (int window = 0; window < kWindows; ++window) {
    const VectorXd y = c.carried(x) + root * VectorXd::NullaryExpr(n, draw);
    c.s = c.S * y + c.S.llt().matrixL() * VectorXd::NullaryExpr(n, draw);
    JointEstimate solved = c.estimate;
    solved.sizes = AccelErrorSizes(truth.jolts.size());
    for (int pass = 0; pass < kPasses; ++pass) {
      const JointSystem system(c.problem, composed(solved.sizes), c.S, c.s, c.estimate, model);
      EXPECT_TRUE(system.solve(&solved));
    }
    logarithm.slow += std::log(solved.sizes.slow) / kWindows;
    logarithm.white += std::log(solved.sizes.white) / kWindows;
    logarithm.jolts += solved.sizes.jolts.array().log().matrix() / kWindows;
  }
  AccelErrorSizes mean;
  mean.slow = std::exp(logarithm.slow);
  mean.white = std::exp(logarithm.white);
  mean.jolts = logarithm.jolts.array().exp();
  return mean;
}

/** The sizes stay where they are believed if that is right; elsewhere they go most of the way. */
TEST(JointSystem, FindsTheSizesOfTheAccelerometersErrorsInTheWindow) {
  const double twice = std::pow(2.0, 0.8);
  const auto expectSizes = [](double slow, double white, double spread, double expected_slow,
                              double expected_white) {
    AccelErrorSizes truth(kSizesKeyframes - 1);
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
  AccelErrorSizes truth(kSizesKeyframes - 1);
  truth.jolts(kJolted) = 8.0;
  const AccelErrorSizes found = estimatedSizes(truth, 0.5, 2.0);
  EXPECT_GT(found.jolts(kJolted), 4.0);
  EXPECT_NEAR(found.slow, 1.0, 0.2);
  EXPECT_NEAR(found.white, 1.0, 0.2);
  Eigen::VectorXd others = found.jolts;
  others(kJolted) = 1.0;
  EXPECT_LT(others.maxCoeff(), 1.5);
}

TEST(JointSystem, HasNoCovarianceWhereTheCostHasNoMinimum) {
  const JointCase c;
  JointEstimate solved = c.estimate;
  ASSERT_TRUE(JointSystem(c.problem, c.motion, c.S, c.s, c.estimate, {}).solve(&solved));
  // Curvature that noise has made negative, beyond what the IMU makes good.
  const JointSystem saddle(c.problem, c.motion, -c.S, c.s, c.estimate, {});
  EXPECT_EQ(saddle.covariance(solved, allKeyframes(c)).size(), 0);
}

TEST(JointSystem, TakesForExactWhatTheModelSays) {
  const JointCase c;
  JointModel model;
  model.estimate_accel_bias = false;
  JointEstimate fixed = c.estimate;
  ASSERT_TRUE(JointSystem(c.problem, c.motion, c.S, c.s, c.estimate, model).solve(&fixed));
  EXPECT_LT((fixed.bias.accel - c.problem.priors().mean.accel).norm(), 1e-9);

  model.imu_noise = false;  // the poses are where the IMU carries them
  JointEstimate exact = c.estimate;
  ASSERT_TRUE(JointSystem(c.problem, c.motion, c.S, c.s, c.estimate, model).solve(&exact));
  const VectorXd y = c.carried(unknowns(c.estimate, exact));
  for (size_t k = 1; k < exact.T_VB.size(); ++k)
    EXPECT_LT((exact.T_VB[k].t - c.estimate.T_VB[k].t - y.segment<3>(6 * k - 3)).norm(), 1e-9);
}

}  // namespace
}  // namespace etalon
