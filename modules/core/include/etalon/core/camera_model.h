#pragma once

#include <Eigen/Core>
#include <optional>

namespace etalon {

/**
 * Pinhole camera with radial-tangential (Brown-Conrady) distortion, EuRoC's model:
 *   x = X/Z, y = Y/Z, r2 = x^2 + y^2, d = 1 + k1 r2 + k2 r2^2
 *   x' = x d + 2 p1 x y + p2 (r2 + 2 x^2),  y' = y d + p1 (r2 + 2 y^2) + 2 p2 x y
 *   u = fu x' + cu,  v = fv y' + cv
 * Pixels: the centre of the top-left pixel is (0, 0).
 */
struct PinholeRadtan {
  int width = 0;   ///< px
  int height = 0;  ///< px
  double fu = 0, fv = 0, cu = 0, cv = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;

  /** Normalised image coordinates (X/Z, Y/Z) to distorted ones. `J`, if given, receives the 2x2
   * derivative. */
  Eigen::Vector2d distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J = nullptr) const;

  /** Normalised image coordinates to pixels. `J`, if given, receives d(pixel)/d(xy), 2x2. */
  Eigen::Vector2d normalizedToPixel(const Eigen::Vector2d& xy, Eigen::Matrix2d* J = nullptr) const;

  /**
   * A point in the camera frame (m) to its pixel; nothing if it lies behind the camera or outside
   * the range where the distortion is one-to-one. `J`, if given, receives d(pixel)/d(p_C), 2x3.
   */
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                         Eigen::Matrix<double, 2, 3>* J = nullptr) const;

  /** A pixel to normalised, undistorted coordinates (X/Z, Y/Z), by Newton iterations to 1e-12. */
  std::optional<Eigen::Vector2d> pixelToNormalized(const Eigen::Vector2d& pixel) const;

  /** Whether the pixel lies in the image, at least `border_px` from its edge. */
  bool inImage(const Eigen::Vector2d& pixel, double border_px = 0.0) const;
};

}  // namespace etalon
