#pragma once

/*
 * Linear least squares |A x + b|^2 kept as its rows, and what marginalisation does to them. Working
 * on rows instead of A^T A keeps twice as many digits, and what is left is positive semidefinite
 * however often it is repeated. The elimination by Householder reflections with the marginalised
 * columns first follows Demmel, Schubert, Sommer, Usenko and Cremers, Square Root Marginalization
 * for Sliding-Window Bundle Adjustment, ICCV 2021.
 */

#include <Eigen/Core>

namespace etalon {

/** The cost |A x + b|^2: one row a residual, whitened. */
struct LinearRows {
  Eigen::MatrixXd A;  ///< rows x unknowns
  Eigen::VectorXd b;  ///< rows

  LinearRows() = default;
  LinearRows(Eigen::Index rows, Eigen::Index unknowns)
      : A(Eigen::MatrixXd::Zero(rows, unknowns)), b(Eigen::VectorXd::Zero(rows)) {}
  Eigen::Index rows() const { return A.rows(); }
  Eigen::Index unknowns() const { return A.cols(); }
};

/**
 * Minimises over the first `count` unknowns: rows of the others alone, whose cost at any x is the
 * least that the marginalised ones allow (a constant apart). An unknown that the rows do not
 * determine (its column is zero, relative to what it was, by the square root of the machine's
 * precision) takes no row away.
 */
LinearRows marginalizeFirst(const LinearRows& rows, Eigen::Index count);

/**
 * The same cost (a constant apart) in as many rows as there are unknowns, at most. Those that were
 * fewer to begin with stay; others come with the last unknown in the first row alone, the last but
 * one in the first two, and so on: to marginalise the last ones then touches few rows, and so does
 * compressing with few more.
 */
LinearRows compressed(const LinearRows& rows);

/**
 * Rows with A^T A = H and A^T b = g for a symmetric positive semidefinite H, g in its range: as
 * many as H has pivots above 1e-13 of its diagonal, in pivoting order.
 */
LinearRows squareRoot(const Eigen::MatrixXd& H, const Eigen::VectorXd& g);

}  // namespace etalon
