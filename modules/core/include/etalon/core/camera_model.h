#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace etalon {

/**
 * The ray of a pixel, and the plane in which small deviations from it are counted: z = 1 of the
 * frame M, which is the camera frame C turned about its centre.
 */
struct MeasuredDirection {
  Eigen::Matrix3d R_MC = Eigen::Matrix3d::Identity();  ///< C to M
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();        ///< of the ray, (x/z, y/z) in M

  /** Along the ray, in C; not of unit length. */
  Eigen::Vector3d ray() const { return R_MC.transpose() * Eigen::Vector3d(xy.x(), xy.y(), 1.0); }
};

/** The equations of one camera with its numbers. A camera model derives from it
 * (docs/adding-a-camera.md); everybody else uses CameraModel. */
class CameraProjection {
 public:
  virtual ~CameraProjection() = default;

  /** As CameraModel::project. */
  virtual std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                                 Eigen::Matrix<double, 2, 3>* J) const = 0;
  /** As CameraModel::unproject; z = 1 if isPerspective(), else of unit length. */
  virtual std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const = 0;
  /** As CameraModel::isPerspective. */
  virtual bool isPerspective() const { return false; }
};

/** A kind of camera: its names, as files and messages use them, and how one is made. */
struct CameraKind {
  std::string camera_model;               ///< "pinhole", of sensor.yaml and camchain.yaml
  std::vector<std::string> distortion;    ///< `distortion_model`; all are read, the first written
  std::vector<std::string> intrinsics;    ///< what `intrinsics` holds, in this order
  std::vector<std::string> coefficients;  ///< what the distortion's coefficients are
  std::shared_ptr<const CameraProjection> (*make)(const std::vector<double>& intrinsics,
                                                  const std::vector<double>& coefficients);
};

/**
 * A camera: image size, and how directions become pixels. A value, cheap to copy.
 * Pixels: the centre of the top-left pixel is (0, 0). Points and rays are in the camera frame C,
 * x to the right, y down, z forward.
 */
class CameraModel {
 public:
  /** No image; projects nothing. */
  CameraModel() = default;

  /**
   * @param camera_model, distortion_model one of cameraKinds(); distortion "none" is one with
   *   coefficients of zero
   * @param intrinsics, coefficients as many as the kind names
   * @throws ConfigError for an unknown kind, a wrong count, focal lengths that are not positive,
   *   numbers that are not finite or an image of no pixels
   */
  CameraModel(const std::string& camera_model, const std::string& distortion_model, int width,
              int height, const std::vector<double>& intrinsics,
              const std::vector<double>& coefficients);

  int width() const { return width_; }    ///< px
  int height() const { return height_; }  ///< px

  /**
   * A point (m, or a direction of any length) to its pixel, which may lie outside the image.
   * Nothing where the camera cannot look: for perspective cameras behind the plane z = 0, and for
   * all beyond the range where the distortion is one-to-one.
   * @param J if given: d(pixel)/d(p_C), 2x3
   */
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                         Eigen::Matrix<double, 2, 3>* J = nullptr) const {
    if (!projection_) return std::nullopt;
    return projection_->project(p_C, J);
  }

  /** A ray through the pixel: with z = 1 if isPerspective(), else of unit length. Nothing where the
   * lens shows nothing. */
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    if (!projection_) return std::nullopt;
    return projection_->unproject(pixel);
  }

  /** Whether all that the camera sees lies in front of it, and its pixels are nearly evenly spaced
   * in the plane z = 1. */
  bool isPerspective() const { return projection_ && projection_->isPerspective(); }

  /** The factor by which the ray of unproject() reaches p_C: the depth z if isPerspective(), else
   * the distance. */
  double rangeOf(const Eigen::Vector3d& p_C) const {
    return isPerspective() ? p_C.z() : p_C.norm();
  }

  /**
   * The direction of a ray: in the plane z = 1 of the camera if isPerspective(), else in the plane
   * that touches the unit sphere at the ray.
   * @param J if given: d(pixel)/d(xy), 2x2
   */
  std::optional<MeasuredDirection> directionOf(const Eigen::Vector3d& ray,
                                               Eigen::Matrix2d* J = nullptr) const;
  /** The same of the ray of a pixel. */
  std::optional<MeasuredDirection> measure(const Eigen::Vector2d& pixel,
                                           Eigen::Matrix2d* J = nullptr) const;

  /** Whether the pixel lies in the image, at least `border_px` from its edge. */
  bool inImage(const Eigen::Vector2d& pixel, double border_px = 0.0) const {
    return pixel.x() >= border_px && pixel.y() >= border_px &&
           pixel.x() <= width_ - 1 - border_px && pixel.y() <= height_ - 1 - border_px;
  }

  /** Pixels a radian on the optical axis, along u and v. */
  const Eigen::Vector2d& focal() const { return focal_; }
  /** Pixel of the optical axis. */
  const Eigen::Vector2d& principalPoint() const { return principal_point_; }

  /** Null if there is no camera. */
  const CameraKind* kind() const { return kind_; }
  const std::vector<double>& intrinsics() const { return intrinsics_; }
  const std::vector<double>& coefficients() const { return coefficients_; }
  /** An intrinsic parameter or a coefficient by its name; ConfigError if the kind has none such. */
  double parameter(const std::string& name) const;
  /** The same camera with another value of that parameter. */
  CameraModel with(const std::string& name, double value) const;

  friend bool operator==(const CameraModel& a, const CameraModel& b) {
    return a.kind_ == b.kind_ && a.width_ == b.width_ && a.height_ == b.height_ &&
           a.intrinsics_ == b.intrinsics_ && a.coefficients_ == b.coefficients_;
  }
  friend bool operator!=(const CameraModel& a, const CameraModel& b) { return !(a == b); }

 private:
  CameraModel(const CameraKind& kind, int width, int height, std::vector<double> intrinsics,
              std::vector<double> coefficients);

  int width_ = 0, height_ = 0;
  const CameraKind* kind_ = nullptr;
  std::vector<double> intrinsics_, coefficients_;
  std::shared_ptr<const CameraProjection> projection_;
  Eigen::Vector2d focal_ = Eigen::Vector2d::Zero(), principal_point_ = Eigen::Vector2d::Zero();
};

/** The camera with a k3 of zero where it is radial-tangential with k1 and k2 alone; another one as it
 * is. */
CameraModel withThirdRadial(const CameraModel& camera);

/** All kinds of cameras. */
const std::vector<CameraKind>& cameraKinds();

/** The kind of these names; null if there is none. A pinhole's distortion "none" is
 * radial-tangential. */
const CameraKind* findCameraKind(const std::string& camera_model,
                                 const std::string& distortion_model);

/** All kinds, for messages: "'pinhole' with 'radial-tangential' (also 'radtan'), ...". */
std::string describeCameraKinds();

}  // namespace etalon
