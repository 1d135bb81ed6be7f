#include "etalon/initialization/joint/joint_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/testing/expect_jacobian.h"
#include "joint_case.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

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
