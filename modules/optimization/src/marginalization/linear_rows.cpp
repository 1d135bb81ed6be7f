#include "etalon/optimization/marginalization/linear_rows.h"

#include <Eigen/Householder>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace etalon {
namespace {

/** [A | b], column by column. */
Eigen::MatrixXd augmented(const LinearRows& rows) {
  Eigen::MatrixXd M(rows.rows(), rows.unknowns() + 1);
  M << rows.A, rows.b;
  return M;
}

LinearRows split(const Eigen::Ref<const Eigen::MatrixXd>& M) {
  LinearRows rows;
  rows.A = M.leftCols(M.cols() - 1);
  rows.b = M.col(M.cols() - 1);
  return rows;
}

}  // namespace

LinearRows marginalizeFirst(const LinearRows& rows, Eigen::Index count) {
  Eigen::MatrixXd M = augmented(rows);
  // A row of zeros in the marginalised columns stays as it is: reflect the others alone.
  std::vector<Eigen::Index> touched, untouched;
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    (M.row(i).head(count).isZero(0.0) ? untouched : touched).push_back(i);
  Eigen::MatrixXd T = M(touched, Eigen::all);
  const Eigen::VectorXd norms = T.leftCols(count).colwise().norm();
  const double tiny = std::sqrt(std::numeric_limits<double>::epsilon());
  Eigen::VectorXd workspace(T.cols());
  Eigen::Index row = 0;
  for (Eigen::Index c = 0; c < count && row < T.rows(); ++c) {
    auto column = T.col(c).tail(T.rows() - row);
    if (!(column.norm() > tiny * norms[c])) continue;
    double tau = 0.0, beta = 0.0;
    Eigen::VectorXd essential(column.size() - 1);
    column.makeHouseholder(essential, tau, beta);
    T.bottomRightCorner(T.rows() - row, T.cols() - c - 1)
        .applyHouseholderOnTheLeft(essential, tau, workspace.data());
    ++row;
  }
  const Eigen::Index left = T.rows() - row;
  Eigen::MatrixXd kept(left + untouched.size(), M.cols() - count);
  kept.topRows(left) = T.bottomRightCorner(left, M.cols() - count);
  kept.bottomRows(kept.rows() - left) = M(untouched, Eigen::lastN(M.cols() - count));
  return split(kept);
}

LinearRows compressed(const LinearRows& rows) {
  if (rows.rows() <= rows.unknowns()) return rows;
  // Householder's reflections, the last column first, each of the rows that have something in it:
  // of rows that were compressed before one more a column.
  const Eigen::Index m = rows.rows(), n = rows.unknowns();
  std::vector<Eigen::Index> last(m), order(m);  // column that is not zero
  std::iota(order.begin(), order.end(), 0);
  for (Eigen::Index i = 0; i < m; ++i) {
    last[i] = n - 1;
    while (last[i] >= 0 && rows.A(i, last[i]) == 0.0) --last[i];
  }
  std::stable_sort(order.begin(), order.end(),
                   [&last](Eigen::Index i, Eigen::Index j) { return last[i] > last[j]; });
  Eigen::MatrixXd M(m, n + 1);
  M << rows.A(order, Eigen::lastN(n).reverse()), rows.b(order);
  Eigen::VectorXd workspace(n + 1), essential(m);
  Eigen::Index reached = 0;  // rows before this one have something in the columns so far
  for (Eigen::Index c = 0; c < n; ++c) {
    while (reached < m && last[order[reached]] >= n - 1 - c) ++reached;
    const Eigen::Index height = reached - c;
    if (height < 2) continue;
    auto tail = essential.head(height - 1);
    double tau = 0.0, beta = 0.0;
    M.col(c).segment(c, height).makeHouseholder(tail, tau, beta);
    M(c, c) = beta;
    M.col(c).segment(c + 1, height - 1).setZero();
    M.block(c, c + 1, height, n - c).applyHouseholderOnTheLeft(tail, tau, workspace.data());
  }
  LinearRows triangular;
  triangular.A = M.topLeftCorner(n, n).rowwise().reverse();
  triangular.b = M.col(n).head(n);
  return triangular;
}

LinearRows squareRoot(const Eigen::MatrixXd& H, const Eigen::VectorXd& g) {
  // Cholesky with complete pivoting, one outer product a row: Eigen's LDLT pivots by a diagonal
  // that it has not updated, and does not tell the rank. To a unit diagonal first: the unknowns'
  // units differ by orders of magnitude.
  const Eigen::Index n = H.rows();
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale[i] = H(i, i) > 0.0 ? 1.0 / std::sqrt(H(i, i)) : 0.0;
  Eigen::MatrixXd left = scale.asDiagonal() * H * scale.asDiagonal();
  Eigen::VectorXd left_g = scale.cwiseProduct(g);
  std::vector<Eigen::Index> unknown(n);  // of each column of `left`, whose first `rank` are done
  std::iota(unknown.begin(), unknown.end(), 0);
  LinearRows rows(n, n);
  Eigen::Index rank = 0;
  for (; rank < n; ++rank) {
    Eigen::Index pivot = 0;
    const double largest = left.diagonal().tail(n - rank).maxCoeff(&pivot);
    if (!(largest > 1e-13)) break;
    pivot += rank;
    left.row(rank).swap(left.row(pivot));
    left.col(rank).swap(left.col(pivot));
    std::swap(left_g[rank], left_g[pivot]);
    std::swap(unknown[rank], unknown[pivot]);
    const Eigen::VectorXd row = left.col(rank).tail(n - rank) / std::sqrt(largest);
    const double b = left_g[rank] / std::sqrt(largest);
    const Eigen::Index after = n - rank - 1;
    left.bottomRightCorner(after, after).noalias() -= row.tail(after) * row.tail(after).transpose();
    left_g.tail(after) -= b * row.tail(after);
    for (Eigen::Index i = rank; i < n; ++i) rows.A(rank, unknown[i]) = row[i - rank];
    rows.b[rank] = b;
  }
  for (Eigen::Index i = 0; i < n; ++i)
    if (scale[i] > 0.0) rows.A.col(i) /= scale[i];
  rows.A.conservativeResize(rank, n);
  rows.b.conservativeResize(rank);
  return rows;
}

}  // namespace etalon
