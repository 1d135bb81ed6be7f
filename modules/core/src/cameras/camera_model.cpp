#include "etalon/core/camera_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cameras/kinds.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"

namespace etalon {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

const std::vector<CameraKind>& cameraKinds() {
  static const std::vector<CameraKind> kinds = allCameraKinds();
  return kinds;
}

const CameraKind* findCameraKind(const std::string& camera_model,
                                 const std::string& distortion_model) {
  for (const CameraKind& kind : cameraKinds()) {
    const auto& names = kind.distortion;
    if (kind.camera_model == camera_model &&
        (std::find(names.begin(), names.end(), distortion_model) != names.end() ||
         distortion_model == "none"))
      return &kind;
  }
  return nullptr;
}

std::string describeCameraKinds() {
  std::string text;
  for (const CameraKind& kind : cameraKinds()) {
    text += (text.empty() ? "'" : ", '") + kind.camera_model + "' with";
    for (size_t i = 0; i < kind.distortion.size(); ++i)
      text += (i == 0 ? " '" : i == 1 ? " (also '" : ", '") + kind.distortion[i] + "'";
    if (kind.distortion.size() > 1) text += ")";
  }
  return text;
}

namespace {

const CameraKind& kindOrThrow(const std::string& camera_model,
                              const std::string& distortion_model) {
  if (const CameraKind* kind = findCameraKind(camera_model, distortion_model)) return *kind;
  throw ConfigError("the camera model '" + camera_model + "' with distortion '" + distortion_model +
                    "' is not supported; supported is " + describeCameraKinds());
}

std::string listOf(const std::vector<std::string>& names) { return "[" + joined(names) + "]"; }

void checkNumbers(const std::vector<double>& values, const std::vector<std::string>& names) {
  const bool finite =
      std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  if (values.size() != names.size() || !finite)
    throw ConfigError("expected the " + std::to_string(names.size()) + " finite numbers " +
                      listOf(names) + " of a camera, found " + std::to_string(values.size()) +
                      (finite ? "" : ", not all finite"));
}

}  // namespace

CameraModel::CameraModel(const CameraKind& kind, int width, int height,
                         std::vector<double> intrinsics, std::vector<double> coefficients)
    : width_(width),
      height_(height),
      kind_(&kind),
      intrinsics_(std::move(intrinsics)),
      coefficients_(std::move(coefficients)) {
  checkNumbers(intrinsics_, kind.intrinsics);
  checkNumbers(coefficients_, kind.coefficients);
  if (width < 1 || height < 1) throw ConfigError("expected an image of at least 1 x 1 px");
  projection_ = kind.make(intrinsics_, coefficients_);
  Eigen::Matrix<double, 2, 3> J;
  const auto pixel = project(Vector3d::UnitZ(), &J);
  if (!pixel || !(J(0, 0) > 0.0) || !(J(1, 1) > 0.0))
    throw ConfigError("expected positive focal lengths in " + listOf(kind.intrinsics));
  focal_ = {J(0, 0), J(1, 1)};
  principal_point_ = *pixel;
}

CameraModel::CameraModel(const std::string& camera_model, const std::string& distortion_model,
                         int width, int height, const std::vector<double>& intrinsics,
                         const std::vector<double>& coefficients)
    : CameraModel(kindOrThrow(camera_model, distortion_model), width, height, intrinsics,
                  distortion_model == "none" && coefficients.empty()
                      ? std::vector<double>(
                            kindOrThrow(camera_model, distortion_model).coefficients.size(), 0.0)
                      : coefficients) {}

std::optional<MeasuredDirection> CameraModel::directionOf(const Vector3d& ray, Matrix2d* J) const {
  MeasuredDirection direction;
  Vector3d on_plane;
  if (isPerspective()) {
    direction.xy = ray.hnormalized();
    on_plane = direction.xy.homogeneous();
  } else {
    on_plane = ray.normalized();
    const Vector3d x = tangentBasis(on_plane).col(0);
    direction.R_MC << x.transpose(), on_plane.cross(x).transpose(), on_plane.transpose();
  }
  if (!J) return direction;
  Eigen::Matrix<double, 2, 3> by_ray;
  if (!project(on_plane, &by_ray)) return std::nullopt;
  *J = by_ray * direction.R_MC.transpose().leftCols<2>();
  return direction;
}

std::optional<MeasuredDirection> CameraModel::measure(const Vector2d& pixel, Matrix2d* J) const {
  const std::optional<Vector3d> ray = unproject(pixel);
  if (!ray) return std::nullopt;
  return directionOf(*ray, J);
}

namespace {

/** Position of a parameter, the coefficients after the intrinsics. */
size_t indexOf(const std::string& name, const CameraKind* kind) {
  if (kind) {
    std::vector<std::string> names = kind->intrinsics;
    names.insert(names.end(), kind->coefficients.begin(), kind->coefficients.end());
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return found - names.begin();
  }
  throw ConfigError("the camera has no parameter '" + name + "'");
}

}  // namespace

double CameraModel::parameter(const std::string& name) const {
  const size_t i = indexOf(name, kind_), n = intrinsics_.size();
  return i < n ? intrinsics_[i] : coefficients_[i - n];
}

CameraModel CameraModel::with(const std::string& name, double value) const {
  std::vector<double> intrinsics = intrinsics_, coefficients = coefficients_;
  const size_t i = indexOf(name, kind_), n = intrinsics.size();
  (i < n ? intrinsics[i] : coefficients[i - n]) = value;
  return {*kind_, width_, height_, std::move(intrinsics), std::move(coefficients)};
}

CameraModel withThirdRadial(const CameraModel& camera) {
  if (!camera.kind() || camera.kind()->distortion.front() != "radial-tangential") return camera;
  std::vector<double> coefficients = camera.coefficients();
  coefficients.push_back(0.0);
  return {camera.kind()->camera_model,
          "radial-tangential-k3",
          camera.width(),
          camera.height(),
          camera.intrinsics(),
          coefficients};
}

}  // namespace etalon
