#include "etalon/initialization/predicted_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/initialization/estimation_error.h"

namespace etalon {
namespace {

TEST(PredictedError, IsTheQuantileOfTheLengthWhereDirectionsAreAlikeOrOne) {
  // Quantiles of the normal and of the Rayleigh distribution, sqrt(-2 ln 0.01), at 99 %.
  const Eigen::Matrix2d alike = 0.25 * Eigen::Matrix2d::Identity();
  EXPECT_NEAR(predictedError(alike, 0.99).bound, 0.5 * 3.0349, 1e-4);
  EXPECT_TRUE(predictedError(alike, 0.99).alike_in_all_directions);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3.0;
  const PredictedError one = predictedError(4.0 * axis * axis.transpose(), 0.99);
  EXPECT_NEAR(one.bound, 2.0 * 2.5758, 1e-3);
  EXPECT_FALSE(one.alike_in_all_directions);
  EXPECT_NEAR(std::abs(one.worst.dot(axis)), 1.0, 1e-12);
}

TEST(PredictedError, IsCloseToTheQuantileInBetween) {
  const Eigen::Vector3d sigma(1.0, 0.6, 0.2);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<double> lengths(100'000);
  for (double& length : lengths)
    length =
        std::sqrt(std::pow(sigma[0] * normal(random), 2) + std::pow(sigma[1] * normal(random), 2) +
                  std::pow(sigma[2] * normal(random), 2));
  std::sort(lengths.begin(), lengths.end());
  const Eigen::Matrix3d covariance = sigma.cwiseAbs2().asDiagonal();
  for (const double confidence : {0.9, 0.95, 0.99}) {
    const double sampled = lengths[static_cast<size_t>(confidence * 100'000.0)];
    // Satterthwaite's own error here, and 1 % of the sample's.
    EXPECT_NEAR(predictedError(covariance, confidence).bound, sampled, 0.03 * sampled);
  }
}

TEST(PredictedError, OfNoErrorIsNone) {
  EXPECT_EQ(predictedError(Eigen::Matrix3d::Zero(), 0.99).bound, 0.0);
}

TEST(LargestSigma, IsThatOfTheWeakestDirectionWhichIsNoAxis) {
  const Eigen::Vector2d axis = Eigen::Vector2d(1.0, 1.0).normalized();
  const Eigen::Matrix2d covariance = 4.0 * axis * axis.transpose();
  EXPECT_NEAR(largestSigma(covariance), 2.0, 1e-12);  // sqrt(2) along either axis
  EXPECT_EQ(largestSigma(Eigen::Matrix3d::Zero()), 0.0);
}

/** Three keyframes anywhere, with a covariance that leaves position and yaw of the first one free of
 * error. */
VisualInertialBaResult threeKeyframes() {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto draw = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }).eval();
  };
  VisualInertialBaResult result;
  for (int k = 0; k < 3; ++k) {
    NavState state;
    state.T_WB = SE3(expSO3(draw(3, 1)), draw(3, 1));
    state.v_WB = draw(3, 1);
    result.states.push_back(state);
  }
  Eigen::MatrixXd root = draw(33, 33);
  const Eigen::Vector3d down = result.states[0].T_WB.R.transpose().col(2);
  root.topRows<3>() -= down * (down.transpose() * root.topRows<3>());
  root.middleRows<3>(3).setZero();
  result.covariance = root * root.transpose();
  return result;
}

TEST(ClaimedCovariance, IsThatOfTheErrorsAsTheyAreDefined) {
  constexpr double kStep = 1e-6;
  const VisualInertialBaResult result = threeKeyframes();
  std::vector<StampedState> truth;
  for (const NavState& state : result.states) truth.emplace_back(TimeNs{}, state);
  Eigen::MatrixXd J(23, 33);  // by differences
  for (Eigen::Index i = 0; i < 33; ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(33);
    step[i] = kStep;
    std::vector<StampedState> moved = truth;
    for (Eigen::Index k = 0; k < 3; ++k) {
      SE3& T_WB = moved[k].T_WB;
      T_WB.R = T_WB.R * expSO3(step.segment<3>(9 * k));
      T_WB.t += step.segment<3>(9 * k + 3);
      moved[k].v_WB += step.segment<3>(9 * k + 6);
    }
    const ImuBias bias = {step.segment<3>(27), step.segment<3>(30)};
    J.col(i) << estimationError(moved, bias, {truth[0].T_WB.R, truth[2].v_WB, ImuBias()}),
        relativePoseErrors(moved, truth);
  }
  const Eigen::MatrixXd expected = J * result.covariance * J.transpose() / (kStep * kStep);
  const double tolerance = 1e-5 * expected.norm();
  EXPECT_LT((claimedJointCovariance(result) - expected).norm(), tolerance);
  EXPECT_LT((claimedCovariance(result) - expected.topLeftCorner<11, 11>()).norm(), tolerance);
}

TEST(ClaimedCovariance, IsEmptyWhereThereIsNone) {
  VisualInertialBaResult result = threeKeyframes();
  result.covariance.resize(0, 0);
  EXPECT_EQ(claimedCovariance(result).size(), 0);
  EXPECT_EQ(claimedJointCovariance(result).size(), 0);
}

}  // namespace
}  // namespace etalon
