#include "etalon/initialization/steps/normal_epipolar.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Matrix93d = Eigen::Matrix<double, 9, 3>;

/** Index of the product f[a] f[b] among the six. */
constexpr int kProduct[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

Vector9d vec(const Matrix3d& E) { return Eigen::Map<const Vector9d>(E.data()); }

/** vec(-[t]x R): t . (f_i x R f_j) is its product with vec(f_i f_j^T). */
Vector9d essential(const Vector3d& t, const Matrix3d& R) { return vec(-hat(t) * R); }

/** Derivatives of essential(t, R Exp(d)) by d. */
Matrix93d essentialDerivative(const Vector3d& t, const Matrix3d& R) {
  const Matrix3d E = -hat(t) * R;
  Matrix93d D;
  for (int a = 0; a < 3; ++a) D.col(a) = vec(E * hat(Vector3d::Unit(a)));
  return D;
}

}  // namespace

Matrix3d EpipolarMoments::normals(const Matrix3d& R) const {
  Matrix93d C;
  for (int a = 0; a < 3; ++a) C.col(a) = essential(Vector3d::Unit(a), R);
  return C.transpose().lazyProduct(products().lazyProduct(C).eval());
}

Matrix3d EpipolarMoments::normalCovariance(const Matrix3d& R) const {
  // The trace of the other view's f f^T is one: it picks the sums of w f f^T out of the products.
  Matrix3d first, second;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const int p = kProduct[a][b];
      first(a, b) = sum_(p, 0) + sum_(p, 3) + sum_(p, 5);
      second(a, b) = sum_(0, p) + sum_(3, p) + sum_(5, p);
    }
  return 2.0 * weight_ * Matrix3d::Identity() - first - R * second * R.transpose();
}

Matrix9d EpipolarMoments::products() const {
  Matrix9d K;
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a)
      for (int d = 0; d < 3; ++d)
        for (int c = 0; c < 3; ++c) K(3 * b + a, 3 * d + c) = sum_(kProduct[a][c], kProduct[b][d]);
  return K;
}

EpipolarCost smallestEigenvalueCost(const EpipolarMoments& moments, const Matrix3d& R,
                                    const Matrix3d& N) {
  const Matrix9d K = moments.products();
  Matrix93d C;  // t . n for t along the three axes
  for (int a = 0; a < 3; ++a) C.col(a) = essential(Vector3d::Unit(a), R);
  const Matrix93d KC = K.lazyProduct(C);  // Eigen's blocked product costs more at this size
  const Matrix3d M = C.transpose().lazyProduct(KC);
  const Eigen::LLT<Matrix3d> whitening(N);
  const Matrix3d half = whitening.matrixL().solve(M);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(
      whitening.matrixL().solve(half.transpose()).eval());

  EpipolarCost cost;
  cost.value = eigen.eigenvalues()(0);
  if (eigen.eigenvalues()(1) > 0.0)
    cost.certainty = std::clamp(1.0 - cost.value / eigen.eigenvalues()(1), 0.0, 1.0);
  // Columns t_m with t_m^T N t_m = 1 and t_m^T M t_m = lambda_m.
  const Matrix3d T = whitening.matrixU().solve(eigen.eigenvectors());
  const Vector3d t = T.col(0);
  cost.direction = t.normalized();
  const Matrix93d D = essentialDerivative(t, R);
  cost.gradient = 2.0 * D.transpose() * (KC * t);
  const Matrix93d KD = K.lazyProduct(D);
  cost.hessian = 2.0 * D.transpose().lazyProduct(KD);
  for (int m = 1; m < 3; ++m) {
    if (!(eigen.eigenvalues()(m) > 0.0)) continue;
    const Vector3d cross = D.transpose() * (KC * T.col(m));
    cost.hessian -= 2.0 / eigen.eigenvalues()(m) * cross * cross.transpose();
  }
  return cost;
}

EpipolarCost rotationOnlyCost(const EpipolarMoments& moments, const Matrix3d& R,
                              const Matrix3d& N) {
  const Matrix9d K = moments.products();
  const Eigen::LLT<Matrix3d> whitening(N);
  const Matrix3d T = whitening.matrixU().solve(Matrix3d::Identity().eval());
  EpipolarCost cost;
  for (int m = 0; m < 3; ++m) {
    const Vector9d c = essential(T.col(m), R);
    const Matrix93d D = essentialDerivative(T.col(m), R);
    const Vector9d Kc = K * c;
    cost.value += c.dot(Kc);
    cost.gradient += 2.0 * D.transpose() * Kc;
    const Matrix93d KD = K.lazyProduct(D);
    cost.hessian += 2.0 * D.transpose().lazyProduct(KD);
  }
  return cost;
}

}  // namespace etalon
