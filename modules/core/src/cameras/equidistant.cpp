#include <array>
#include <cmath>

#include "cameras/kinds.h"

namespace etalon {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/**
 * Fisheye of Kannala and Brandt ("A generic camera model and calibration method for conventional,
 * wide-angle, and fish-eye lenses", PAMI 2006), eqs. (6) and (11), in the form with four
 * coefficients that Kalibr calls equidistant and OpenCV fisheye:
 *   theta   = atan2(r, Z), r = sqrt(X^2 + Y^2): the angle to the optical axis, up to 180 degrees
 *   theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
 *   u = fu theta_d X / r + cu,  v = fv theta_d Y / r + cv
 * It holds as far as theta_d rises. On the axis X / r is no number and theta_d / r goes to 1 / Z.
 */
class Equidistant final : public CameraProjection {
 public:
  Equidistant(const std::vector<double>& f, const std::vector<double>& k)
      : fu_(f[0]), fv_(f[1]), cu_(f[2]), cv_(f[3]), k_{k[0], k[1], k[2], k[3]} {
    theta_max_ = firstTurn();
    radius_max_ = distort(theta_max_);
  }

  std::optional<Vector2d> project(const Vector3d& p_C,
                                  Eigen::Matrix<double, 2, 3>* J) const override;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const override;

 private:
  /** theta_d. */
  double distort(double theta) const {
    const double t2 = theta * theta;
    return theta * (1.0 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3]))));
  }
  /** d(theta_d)/d(theta). */
  double slope(double theta) const {
    const double t2 = theta * theta;
    return 1.0 + t2 * (3.0 * k_[0] + t2 * (5.0 * k_[1] + t2 * (7.0 * k_[2] + t2 * 9.0 * k_[3])));
  }
  double firstTurn() const;

  double fu_, fv_, cu_, cv_;
  std::array<double, 4> k_;
  double theta_max_;   // rad: theta_d rises up to here
  double radius_max_;  // its theta_d
};

/** The least angle at which theta_d stops rising; pi if it rises all the way. */
double Equidistant::firstTurn() const {
  constexpr double kPi = 3.14159265358979323846;
  constexpr int kSteps = 4096;  // a dip narrower than this does not show in the image
  for (int i = 1; i <= kSteps; ++i) {
    double high = kPi * i / kSteps;
    if (slope(high) > 0.0) continue;
    double low = kPi * (i - 1) / kSteps;
    for (int bisection = 0; bisection < 50; ++bisection) {
      const double middle = 0.5 * (low + high);
      (slope(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  return kPi;
}

std::optional<Vector2d> Equidistant::project(const Vector3d& p_C,
                                             Eigen::Matrix<double, 2, 3>* J) const {
  const double x = p_C.x(), y = p_C.y(), z = p_C.z();
  const double r2 = x * x + y * y, n2 = r2 + z * z;
  constexpr double kMinDistance2 = 1e-12;  // m^2
  if (!(n2 > kMinDistance2)) return std::nullopt;
  const double r = std::sqrt(r2);
  const double theta = std::atan2(r, z);
  if (!(theta < theta_max_)) return std::nullopt;
  const bool on_axis = r2 < 1e-20 * n2;  // theta below 1e-10, and z positive since theta < pi
  const double s = on_axis ? 1.0 / z : distort(theta) / r;
  if (J) {
    // u = fu s x + cu with s(r, z) = theta_d / r; d(theta)/dr = z / n2, d(theta)/dz = -r / n2.
    const double g = slope(theta);
    // (ds/dr) / r. The digits that the difference loses near the axis are multiplied by x^2 < r^2.
    const double a = on_axis ? 0.0 : (g * z / n2 - s) / r2;
    const double b = -g / n2;                                   // ds/dz
    *J << fu_ * (s + a * x * x), fu_ * a * x * y, fu_ * b * x,  //
        fv_ * a * x * y, fv_ * (s + a * y * y), fv_ * b * y;
  }
  return Vector2d(fu_ * (s * x) + cu_, fv_ * (s * y) + cv_);
}

std::optional<Vector3d> Equidistant::unproject(const Vector2d& pixel) const {
  const Vector2d m((pixel.x() - cu_) / fu_, (pixel.y() - cv_) / fv_);
  const double radius = m.norm();
  if (!(radius < radius_max_)) return std::nullopt;
  if (radius < 1e-10) return Vector3d(m.x(), m.y(), 1.0);  // of unit length to 1e-20
  // Newton within [low, high], where theta_d rises from below `radius` to above it.
  double low = 0.0, high = theta_max_;
  double theta = std::min(radius, 0.5 * theta_max_);
  for (int i = 0; i < 60; ++i) {
    const double error = distort(theta) - radius;
    (error > 0.0 ? high : low) = theta;
    double next = theta - error / slope(theta);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double step = std::abs(next - theta);
    theta = next;
    if (step < 1e-15 * (1.0 + theta)) break;
  }
  const double scale = std::sin(theta) / radius;
  return Vector3d(scale * m.x(), scale * m.y(), std::cos(theta));
}

}  // namespace

CameraKind equidistant() {
  return {"pinhole",
          {"equidistant", "kannala_brandt", "fisheye"},
          {"fu", "fv", "cu", "cv"},
          {"k1", "k2", "k3", "k4"},
          [](const std::vector<double>& f,
             const std::vector<double>& d) -> std::shared_ptr<const CameraProjection> {
            return std::make_shared<Equidistant>(f, d);
          }};
}

}  // namespace etalon
