#include "etalon/initialization/predicted_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

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

}  // namespace
}  // namespace etalon
