#include "etalon/initialization/steps/normal_epipolar.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Views {
  Matrix3d R;  // R_CiCj
  std::vector<Vector3d> f_i, f_j;
};

/** Bearings of `count` landmarks 2 to 6 m ahead, noise in radians on the unit sphere. */
Views makeViews(const Vector3d& rotation, const Vector3d& t_i_j, double noise, int count = 60) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> normal;
  const auto noisy = [&](const Vector3d& p) {
    return (p.normalized() + noise * Vector3d(normal(rng), normal(rng), normal(rng))).normalized();
  };
  Views views;
  views.R = expSO3(rotation);
  for (int k = 0; k < count; ++k) {
    const double z = 4.0 + 2.0 * unit(rng);
    const Vector3d p(0.7 * z * unit(rng), 0.5 * z * unit(rng), z);
    views.f_i.push_back(noisy(p));
    views.f_j.push_back(noisy(views.R.transpose() * (p - t_i_j)));
  }
  return views;
}

EpipolarMoments momentsOf(const Views& views) {
  EpipolarMoments moments;
  for (size_t k = 0; k < views.f_i.size(); ++k)
    moments.add(views.f_i[k], views.f_j[k], 0.5 + 0.01 * static_cast<double>(k));
  return moments;
}

/** Hard points: no rotation, ordinary, large (2.5 rad), near pi. */
const Vector3d kRotations[] = {
    {0, 0, 0}, {0.05, -0.03, 0.08}, {1.5, -1.0, 1.7}, {0, 0, M_PI - 1e-6}};

TEST(EpipolarMoments, GiveTheSumOfTheNormalsOuterProducts) {
  for (const Vector3d& rotation : kRotations) {
    const Views views = makeViews(rotation, {0.3, 0.1, -0.2}, 1e-3);
    const Matrix3d R = views.R * expSO3(Vector3d(0.01, 0.02, -0.03));
    Matrix3d M = Matrix3d::Zero(), N = Matrix3d::Zero();
    for (size_t k = 0; k < views.f_i.size(); ++k) {
      const double w = 0.5 + 0.01 * static_cast<double>(k);
      const Vector3d g = R * views.f_j[k], n = views.f_i[k].cross(g);
      M += w * n * n.transpose();
      N += w * (2.0 * Matrix3d::Identity() - views.f_i[k] * views.f_i[k].transpose() -
                g * g.transpose());
    }
    const EpipolarMoments moments = momentsOf(views);
    EXPECT_LT((moments.normals(R) - M).norm(), 1e-12);
    EXPECT_LT((moments.normalCovariance(R) - N).norm(), 1e-11);
  }
}

TEST(NormalEpipolar, VanishesAtTheTrueRotationAndFindsTheDirection) {
  const Vector3d t(0.3, 0.1, -0.2);
  for (const Vector3d& rotation : kRotations) {
    const Views views = makeViews(rotation, t, 0.0);
    const EpipolarMoments moments = momentsOf(views);
    const EpipolarCost cost =
        smallestEigenvalueCost(moments, views.R, moments.normalCovariance(views.R));
    EXPECT_LT(std::abs(cost.value), 1e-14);  // rounding of sums of order 60
    EXPECT_LT(cost.gradient.norm(), 1e-12);
    EXPECT_NEAR(std::abs(cost.direction.dot(t.normalized())), 1.0, 1e-10);
  }
}

using CostFunction = EpipolarCost (*)(const EpipolarMoments&, const Matrix3d&, const Matrix3d&);

TEST(NormalEpipolar, GradientAgreesWithDifferences) {
  const Vector3d translations[] = {{0.3, 0.1, -0.2}, {0, 0, 0.4}, {0.02, 0, 0}, {0, 0, 0}};
  for (const CostFunction cost : {&smallestEigenvalueCost, &rotationOnlyCost})
    for (const Vector3d& rotation : kRotations)
      for (const Vector3d& t : translations) {
        const Views views = makeViews(rotation, t, 2e-3);
        const EpipolarMoments moments = momentsOf(views);
        const Matrix3d R = views.R * expSO3(Vector3d(0.02, -0.01, 0.03));
        for (const Matrix3d& N : {Matrix3d(Matrix3d::Identity()), moments.normalCovariance(R)}) {
          const EpipolarCost at = cost(moments, R, N);
          // Values of order 0.01 to 1. Without parallax two eigenvalues nearly meet and the fifth
          // derivative is large: truncation of 1e-9 at this step, rounding of 1e-12.
          testing::expectJacobian(
              at.gradient.transpose(),
              [&](const Matrix3d& turned) { return cost(moments, turned, N).value; }, R,
              {1e-4, 1e-8});
        }
      }
}

TEST(NormalEpipolar, HessianIsExactWhereTheResidualsVanish) {
  for (const CostFunction cost : {&smallestEigenvalueCost, &rotationOnlyCost})
    for (const Vector3d& rotation : kRotations) {
      const Vector3d t = cost == &rotationOnlyCost ? Vector3d::Zero() : Vector3d(0.3, 0.1, -0.2);
      const Views views = makeViews(rotation, t, 0.0);
      const EpipolarMoments moments = momentsOf(views);
      const Matrix3d N = moments.normalCovariance(views.R);
      const Eigen::MatrixXd numerical = testing::numericalJacobian(
          [&](const Matrix3d& R) { return cost(moments, R, N).gradient; }, views.R, 1e-4);
      const Matrix3d analytic = cost(moments, views.R, N).hessian;
      // The difference quotient's own error is of order step^2 times the fourth derivative.
      EXPECT_LT((analytic - numerical).norm(), 1e-4 * analytic.norm());
    }
}

TEST(NormalEpipolar, WhitenedCostIsTheVarianceOfABearingWhateverTheDirection) {
  constexpr double kNoise = 1e-3;
  for (const Vector3d& t : {Vector3d(0.4, 0, 0), Vector3d(0, 0.4, 0), Vector3d(0, 0, 0.6)}) {
    const Views views = makeViews({0.05, -0.03, 0.08}, t, kNoise, 2000);
    EpipolarMoments moments;
    for (size_t k = 0; k < views.f_i.size(); ++k) moments.add(views.f_i[k], views.f_j[k], 1.0);
    const double value =
        smallestEigenvalueCost(moments, views.R, moments.normalCovariance(views.R)).value;
    // 2000 squared residuals scatter by 3 %; parallax of 0.1 rad makes N itself off by 1 %.
    EXPECT_NEAR(value / (kNoise * kNoise), 1.0, 0.12) << t.transpose();
  }
}

}  // namespace
}  // namespace etalon
