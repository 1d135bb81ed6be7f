#include "etalon/core/camera_model.h"

#include <Eigen/LU>

namespace etalon {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/**
 * Whether the distortion is one-to-one from the centre out to `xy`: r (1 + k1 r^2 + k2 r^4) rises
 * all the way, and with the decentring terms the derivative D keeps its orientation.
 */
static bool isBeforeFold(const PinholeRadtan& camera, const Vector2d& xy, const Matrix2d& D) {
  const double r2 = xy.squaredNorm();
  const double slope = 1.0 + r2 * (3.0 * camera.k1 + r2 * 5.0 * camera.k2);
  if (!(slope > 0.0) || !(D.determinant() > 0.0)) return false;
  // The slope falls with r^2 while k1 < 0; beyond its minimum it may have been negative already.
  const double a = 5.0 * camera.k2, b = 3.0 * camera.k1;
  const bool turns_back = a > 0.0 && b < 0.0 && b * b > 4.0 * a;
  return !turns_back || 2.0 * a * r2 < -b;
}

Vector2d PinholeRadtan::distort(const Vector2d& xy, Matrix2d* J) const {
  const double x = xy.x(), y = xy.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + k2 * r2);
  if (J) {
    const double dradial = 2.0 * (k1 + 2.0 * k2 * r2);  // d(radial)/d(r2) * 2
    (*J)(0, 0) = radial + x * x * dradial + 2.0 * p1 * y + 6.0 * p2 * x;
    (*J)(0, 1) = x * y * dradial + 2.0 * p1 * x + 2.0 * p2 * y;
    (*J)(1, 0) = (*J)(0, 1);
    (*J)(1, 1) = radial + y * y * dradial + 6.0 * p1 * y + 2.0 * p2 * x;
  }
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

Vector2d PinholeRadtan::normalizedToPixel(const Vector2d& xy, Matrix2d* J) const {
  const Vector2d d = distort(xy, J);
  if (J) {
    J->row(0) *= fu;
    J->row(1) *= fv;
  }
  return {fu * d.x() + cu, fv * d.y() + cv};
}

std::optional<Vector2d> PinholeRadtan::project(const Eigen::Vector3d& p_C,
                                               Eigen::Matrix<double, 2, 3>* J) const {
  constexpr double kMinDepth = 1e-6;  // m
  if (!(p_C.z() > kMinDepth)) return std::nullopt;
  const double inv_z = 1.0 / p_C.z();
  const Vector2d xy = p_C.head<2>() * inv_z;
  Matrix2d D;
  const Vector2d pixel = normalizedToPixel(xy, &D);
  if (!isBeforeFold(*this, xy, D)) return std::nullopt;
  if (J) {
    J->leftCols<2>() = D * inv_z;
    J->col(2) = -(D * xy) * inv_z;
  }
  return pixel;
}

std::optional<Vector2d> PinholeRadtan::pixelToNormalized(const Vector2d& pixel) const {
  const Vector2d target((pixel.x() - cu) / fu, (pixel.y() - cv) / fv);
  Vector2d xy = target;
  for (int i = 0; i < 30; ++i) {
    Matrix2d J;
    const Vector2d error = distort(xy, &J) - target;
    if (!(J.determinant() > 1e-6)) return std::nullopt;
    const Vector2d step = J.inverse() * error;
    xy -= step;
    if (step.squaredNorm() > 1e-24) continue;
    if (!isBeforeFold(*this, xy, J)) return std::nullopt;
    return xy;
  }
  return std::nullopt;
}

bool PinholeRadtan::inImage(const Vector2d& pixel, double border_px) const {
  return pixel.x() >= border_px && pixel.y() >= border_px && pixel.x() <= width - 1 - border_px &&
         pixel.y() <= height - 1 - border_px;
}

}  // namespace etalon
