#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cameras/kinds.h"

namespace etalon {

using Eigen::Matrix2d;
using Eigen::Vector2d;

namespace {

/**
 * Pinhole camera with radial-tangential (Brown-Conrady) distortion, EuRoC's model and, with k3,
 * OpenCV's of five coefficients:
 *   x = X/Z, y = Y/Z, r2 = x^2 + y^2, d = 1 + k1 r2 + k2 r2^2 + k3 r2^3
 *   x' = x d + 2 p1 x y + p2 (r2 + 2 x^2),  y' = y d + p1 (r2 + 2 y^2) + 2 p2 x y
 *   u = fu x' + cu,  v = fv y' + cv
 */
class PinholeRadtan final : public CameraProjection {
 public:
  PinholeRadtan(const std::vector<double>& f, const std::vector<double>& d)
      : fu_(f[0]),
        fv_(f[1]),
        cu_(f[2]),
        cv_(f[3]),
        k1_(d[0]),
        k2_(d[1]),
        k3_(d.size() > 4 ? d[4] : 0.0),
        p1_(d[2]),
        p2_(d[3]),
        r2_fold_(fold()) {}

  std::optional<Vector2d> project(const Eigen::Vector3d& p_C,
                                  Eigen::Matrix<double, 2, 3>* J) const override;
  std::optional<Eigen::Vector3d> unproject(const Vector2d& pixel) const override;
  bool isPerspective() const override { return true; }

 private:
  /** (X/Z, Y/Z) to (x', y'), and the 2x2 derivative. */
  Vector2d distort(const Vector2d& xy, Matrix2d* J) const;
  /** d(r d)/dr */
  double slope(double r2) const {
    return 1.0 + r2 * (3.0 * k1_ + r2 * (5.0 * k2_ + r2 * 7.0 * k3_));
  }
  /** r2 at which r d stops rising; infinity if it rises as far as any lens sees. */
  double fold() const;
  bool isBeforeFold(const Vector2d& xy, const Matrix2d& D) const;

  double fu_, fv_, cu_, cv_, k1_, k2_, k3_, p1_, p2_;
  double r2_fold_;  ///< r d rises up to here
};

/** The slope is a cubic of r2: its least root lies in the first of its monotone pieces that ends below
 * zero. */
double PinholeRadtan::fold() const {
  constexpr double kWidest = 100.0;  // r2 of 84 degrees
  // Where its derivative, 3 (k1 + 10/3 k2 r2 + 7 k3 r2^2), is zero; no number or infinite if nowhere.
  const double a = 7.0 * k3_, b = 10.0 / 3.0 * k2_, c = k1_;
  const double q = -0.5 * (b + std::copysign(std::sqrt(b * b - 4.0 * a * c), b));
  double low = 0.0;
  for (double high : {std::min(q / a, c / q), std::max(q / a, c / q), kWidest}) {
    if (!(high > low && high <= kWidest)) continue;
    if (slope(high) > 0.0) {
      low = high;
      continue;
    }
    for (int bisection = 0; bisection < 60; ++bisection) {
      const double middle = 0.5 * (low + high);
      (slope(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  return std::numeric_limits<double>::infinity();
}

/**
 * Whether the distortion is one-to-one from the centre out to `xy`: r d rises all the way, and
 * with the decentring terms the derivative D keeps its orientation.
 */
bool PinholeRadtan::isBeforeFold(const Vector2d& xy, const Matrix2d& D) const {
  const double r2 = xy.squaredNorm();
  return r2 < r2_fold_ && slope(r2) > 0.0 && D.determinant() > 0.0;
}

Vector2d PinholeRadtan::distort(const Vector2d& xy, Matrix2d* J) const {
  const double x = xy.x(), y = xy.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1_ + r2 * (k2_ + r2 * k3_));
  const double dradial = 2.0 * (k1_ + r2 * (2.0 * k2_ + r2 * 3.0 * k3_));  // d(radial)/d(r2) * 2
  (*J)(0, 0) = radial + x * x * dradial + 2.0 * p1_ * y + 6.0 * p2_ * x;
  (*J)(0, 1) = x * y * dradial + 2.0 * p1_ * x + 2.0 * p2_ * y;
  (*J)(1, 0) = (*J)(0, 1);
  (*J)(1, 1) = radial + y * y * dradial + 6.0 * p1_ * y + 2.0 * p2_ * x;
  return {x * radial + 2.0 * p1_ * x * y + p2_ * (r2 + 2.0 * x * x),
          y * radial + p1_ * (r2 + 2.0 * y * y) + 2.0 * p2_ * x * y};
}

std::optional<Vector2d> PinholeRadtan::project(const Eigen::Vector3d& p_C,
                                               Eigen::Matrix<double, 2, 3>* J) const {
  constexpr double kMinDepth = 1e-6;  // m
  if (!(p_C.z() > kMinDepth)) return std::nullopt;
  const double inv_z = 1.0 / p_C.z();
  const Vector2d xy = p_C.head<2>() * inv_z;
  Matrix2d D;
  const Vector2d d = distort(xy, &D);
  // The sign of the determinant is that of the scaled D: focal lengths are positive.
  if (!isBeforeFold(xy, D)) return std::nullopt;
  if (J) {
    D.row(0) *= fu_;
    D.row(1) *= fv_;
    J->leftCols<2>() = D * inv_z;
    J->col(2) = -(D * xy) * inv_z;
  }
  return Vector2d(fu_ * d.x() + cu_, fv_ * d.y() + cv_);
}

/** Newton iterations to 1e-12 in normalised coordinates. */
std::optional<Eigen::Vector3d> PinholeRadtan::unproject(const Vector2d& pixel) const {
  const Vector2d target((pixel.x() - cu_) / fu_, (pixel.y() - cv_) / fv_);
  Vector2d xy = target;
  for (int i = 0; i < 30; ++i) {
    Matrix2d J;
    const Vector2d error = distort(xy, &J) - target;
    if (!(J.determinant() > 1e-6)) return std::nullopt;
    const Vector2d step = J.inverse() * error;
    xy -= step;
    if (step.squaredNorm() > 1e-16) continue;  // what is left is the square of the step
    if (!isBeforeFold(xy, J)) return std::nullopt;
    return Eigen::Vector3d(xy.x(), xy.y(), 1.0);
  }
  return std::nullopt;
}

std::shared_ptr<const CameraProjection> makePinholeRadtan(const std::vector<double>& f,
                                                          const std::vector<double>& d) {
  return std::make_shared<PinholeRadtan>(f, d);
}

}  // namespace

CameraKind pinholeRadtan() {
  return {"pinhole",
          {"radial-tangential", "radtan", "plumb_bob"},
          {"fu", "fv", "cu", "cv"},
          {"k1", "k2", "p1", "p2"},
          makePinholeRadtan};
}

CameraKind pinholeRadtanK3() {
  return {"pinhole",
          {"radial-tangential-k3"},
          {"fu", "fv", "cu", "cv"},
          {"k1", "k2", "p1", "p2", "k3"},
          makePinholeRadtan};
}

}  // namespace etalon
