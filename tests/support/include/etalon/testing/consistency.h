#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace etalon::testing {

/** Independent standard normal numbers. */
inline Eigen::VectorXd drawn(Eigen::Index size, std::mt19937* random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd x(size);
  for (Eigen::Index i = 0; i < size; ++i) x[i] = normal(*random);
  return x;
}

/** A number that is chi-square distributed if the covariances are right, over many runs. */
struct ChiSquare {
  double sum = 0.0, dof = 0.0;

  void add(double value, double freedom) {
    sum += value;
    dof += freedom;
  }
  double ratio() const { return sum / dof; }
};

/** Within the 99.9 % band of what so many degrees of freedom scatter, and `slack` beyond. */
inline void expectConsistent(const ChiSquare& chi2, double slack = 0.0) {
  EXPECT_NEAR(chi2.ratio(), 1.0, 3.29 * std::sqrt(2.0 / chi2.dof) + slack)
      << chi2.dof << " degrees of freedom";
}

/** Covariance of whitened vectors, which is to be the identity. */
struct WhiteSample {
  Eigen::MatrixXd sum;
  int count = 0;

  void add(const Eigen::VectorXd& w) {
    if (count++ == 0) sum = Eigen::MatrixXd::Zero(w.size(), w.size());
    sum += w * w.transpose();
  }
};

/** Every element within 4.5 of its standard deviations: chance fails one of 100 in 1500 draws. */
inline void expectWhite(const WhiteSample& sample) {
  const Eigen::MatrixXd C = sample.sum / sample.count;
  for (Eigen::Index i = 0; i < C.rows(); ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      EXPECT_NEAR(C(i, j), i == j ? 1.0 : 0.0, 4.5 * std::sqrt((i == j ? 2.0 : 1.0) / sample.count))
          << "element " << i << ", " << j;
}

}  // namespace etalon::testing
