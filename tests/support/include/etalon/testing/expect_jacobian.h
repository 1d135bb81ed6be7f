#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <type_traits>

#include "etalon/core/se3.h"
#include "etalon/core/so3.h"

// Analytic derivatives against differences:
//   expectJacobian(analytic, [&](const SE3& T_WB) { return residual(T_WB, p_W); }, T_WB);
namespace etalon::testing {

/** `x` moved by the tangent vector `d`: vectors by addition, rotations by R Exp(d), poses by
 * [rotation, position] as all Jacobians here. */
template <int N>
Eigen::Matrix<double, N, 1> moved(const Eigen::Matrix<double, N, 1>& x, const Eigen::VectorXd& d) {
  return x + d;
}
inline Eigen::Matrix3d moved(const Eigen::Matrix3d& R, const Eigen::VectorXd& d) {
  return R * expSO3(Eigen::Vector3d(d));
}
inline SE3 moved(const SE3& T, const Eigen::VectorXd& d) {
  return {T.R * expSO3(Eigen::Vector3d(d.head<3>())), T.t + d.tail<3>()};
}

/** Dimension of that tangent space. */
template <int N>
Eigen::Index tangentSize(const Eigen::Matrix<double, N, 1>& x) {
  return x.size();
}
inline Eigen::Index tangentSize(const Eigen::Matrix3d&) { return 3; }
inline Eigen::Index tangentSize(const SE3&) { return 6; }

struct DifferenceOptions {
  /** Of the central differences of order four: truncation grows by its fourth power, rounding is
   * about 1e-16 of the values divided by it. */
  double step = 1e-3;
  /** Of the Frobenius norm of the error, relative to the norms of derivative and value, and 1. */
  double tolerance = 1e-8;
};

/** `f`, which gives a vector or a number, where `x` is moved by `d`. */
template <typename Function, typename Value>
Eigen::VectorXd valueAt(const Function& f, const Value& x, const Eigen::VectorXd& d) {
  const auto value = f(moved(x, d));
  if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
    return Eigen::VectorXd::Constant(1, value);
  else
    return value;
}

/** d f / d x by differences. */
template <typename Function, typename Value>
Eigen::MatrixXd numericalJacobian(const Function& f, const Value& x, double step) {
  const Eigen::Index n = tangentSize(x);
  Eigen::MatrixXd J;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = [&](double h) { return valueAt(f, x, h * Eigen::VectorXd::Unit(n, i)); };
    const Eigen::VectorXd column =
        (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step);
    if (i == 0) J.resize(column.size(), n);
    J.col(i) = column;
  }
  return J;
}

/** `analytic` is d f / d x at `x`. */
template <typename Derived, typename Function, typename Value>
void expectJacobian(const Eigen::MatrixBase<Derived>& analytic, const Function& f, const Value& x,
                    const DifferenceOptions& options = {}) {
  const Eigen::MatrixXd numerical = numericalJacobian(f, x, options.step);
  ASSERT_EQ(analytic.rows(), numerical.rows());
  ASSERT_EQ(analytic.cols(), numerical.cols());
  const double value = valueAt(f, x, Eigen::VectorXd::Zero(tangentSize(x))).norm();
  EXPECT_LT((analytic - numerical).norm(), options.tolerance * (1.0 + numerical.norm() + value))
      << "analytic\n"
      << analytic << "\nnumerical\n"
      << numerical;
}

}  // namespace etalon::testing
