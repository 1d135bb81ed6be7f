#include "calibration_columns.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"

namespace etalon::fixed_lag {
namespace {

/** Columns: the baseline, and two unit vectors across it, in the axes of C0. */
Eigen::Matrix3d baselineAxes(const SE3& T_C0C1) {
  Eigen::Matrix3d axes;
  axes << T_C0C1.t, tangentBasis(T_C0C1.t);
  return axes;
}

constexpr std::array<const char*, kRadialShifts> kRadial = {"k1", "k2", "k3"};
constexpr double kShiftStep = 0.01;  // px; of any size: a pixel is linear in the coefficients

bool hasRadial(const CameraModel& camera) {
  if (!camera.kind()) return false;
  const std::vector<std::string>& names = camera.kind()->coefficients;
  return std::all_of(kRadial.begin(), kRadial.end(), [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

/** d(k1, k2, k3)/d(shifts): at r focal lengths from the axis a pixel is shifted by
 * f (k1 r^3 + k2 r^5 + k3 r^7), with r the tangent of the ray's angle, or the angle where the camera
 * is equidistant. */
Eigen::Matrix3d radialByShift(const CameraModel& given) {
  const double f = given.focal().x();
  Eigen::Matrix3d shift;
  for (int i = 0; i < kRadialShifts; ++i) {
    const double r = (i + 1) / 6.0 * given.width() / f;
    shift.row(i) << f * std::pow(r, 3), f * std::pow(r, 5), f * std::pow(r, 7);
  }
  return shift.inverse();
}

/** `camera` with its radial coefficients changed by what shifts the pixels of `given` so, px. */
CameraModel withRadialShift(const CameraModel& camera, const CameraModel& given,
                            const RadialShift& shift) {
  CameraModel shifted = withThirdRadial(camera);
  if (shift.isZero(0.0) || !hasRadial(shifted)) return camera;
  const RadialShift change = radialByShift(given) * shift;
  for (int i = 0; i < kRadialShifts; ++i)
    shifted = shifted.with(kRadial[i], shifted.parameter(kRadial[i]) + change[i]);
  return shifted;
}

CameraModel corrected(const CameraModel& given, double focal, const Eigen::Vector2d& principal,
                      const RadialShift& radial_shift) {
  const CameraModel camera = given.with("fu", given.parameter("fu") * (1.0 + focal))
                                 .with("fv", given.parameter("fv") * (1.0 + focal))
                                 .with("cu", given.parameter("cu") + principal.x())
                                 .with("cv", given.parameter("cv") + principal.y());
  return withRadialShift(camera, given, radial_shift);
}

/** Derivative of the pixel of a ray by the shifts. @param shifted the camera after a step of each */
Eigen::Matrix<double, 2, kRadialShifts> pixelByShift(
    const CameraModel& camera, const std::array<CameraModel, kRadialShifts>& shifted,
    const Eigen::Vector3d& ray) {
  Eigen::Matrix<double, 2, kRadialShifts> J = Eigen::Matrix<double, 2, kRadialShifts>::Zero();
  const auto pixel = camera.project(ray);
  for (int i = 0; pixel && i < kRadialShifts; ++i)
    if (const auto there = shifted[i].project(ray)) J.col(i) = (*there - *pixel) / kShiftStep;
  return J;
}

/** One over the standard deviation of a pixel that a measurement was made with. */
double inverseSigma(const CameraModel& camera, const ReprojectionMeasurement& measurement) {
  Eigen::Matrix2d J;
  camera.directionOf(measurement.ray(), &J);
  return std::sqrt(measurement.sqrt_information.determinant() / J.determinant());
}

}  // namespace

CalibrationVector calibrationPriorSigma() {
  CalibrationVector sigma;
  sigma[kTimeOffset] = 0.005;
  sigma.segment<3>(kCameraRotation).setConstant(radians(0.5));
  sigma.segment<3>(kCameraPosition).setConstant(0.01);
  sigma.segment<3>(kStereoRotation).setConstant(radians(0.2));
  sigma[kBaseline] = 0.01;
  sigma.segment<2>(kStereoShift).setConstant(0.001);
  sigma.segment<2>(kFocal).setConstant(0.005);
  sigma.segment<4>(kPrincipalPoint).setConstant(3.0);
  sigma.segment<2 * kRadialShifts>(kRadialDistortion) << 0.15, 0.4, 1.0, 0.15, 0.4, 1.0;
  return sigma;
}

StereoInertialCalibration corrected(const StereoInertialCalibration& given,
                                    const CalibrationVector& deviation) {
  StereoInertialCalibration calibration = given;
  for (Eigen::Index c = 0; c < 2; ++c) {
    const double focal = deviation[kFocal + c];
    const Eigen::Vector2d principal = deviation.segment<2>(kPrincipalPoint + 2 * c);
    const RadialShift shift =
        deviation.segment<kRadialShifts>(kRadialDistortion + kRadialShifts * c);
    if (focal != 0.0 || !principal.isZero(0.0) || !shift.isZero(0.0))
      calibration.cameras[c].model = corrected(given.cameras[c].model, focal, principal, shift);
  }
  if (deviation.segment(kCameraRotation, kFocal - kCameraRotation).isZero(0.0)) return calibration;
  SE3& T_BC0 = calibration.cameras[0].T_BC;
  SE3 T_C0C1 = given.rightFromLeft().inverse();
  T_BC0.R = T_BC0.R * expSO3(deviation.segment<3>(kCameraRotation));
  T_BC0.t += deviation.segment<3>(kCameraPosition);
  T_C0C1.R = T_C0C1.R * expSO3(deviation.segment<3>(kStereoRotation));
  T_C0C1.t += baselineAxes(T_C0C1) * deviation.segment<3>(kBaseline);
  calibration.cameras[1].T_BC = T_BC0 * T_C0C1;
  return calibration;
}

ReprojectionMeasurement remeasured(const CameraModel& before, const CameraModel& after,
                                   const ReprojectionMeasurement& measurement) {
  const auto pixel = before.project(measurement.ray());
  if (!pixel) return measurement;
  const auto again = makeMeasurement(after, *pixel, 1.0 / inverseSigma(before, measurement));
  return again.value_or(measurement);
}

CalibrationDerivatives::CalibrationDerivatives(const StereoInertialCalibration& given,
                                               const CalibrationVector& deviation)
    : calibration_(corrected(given, deviation)),
      T_C0C1_(calibration_.rightFromLeft().inverse()),
      deviation_(deviation),
      camera_right_(rightJacobianSO3(deviation.segment<3>(kCameraRotation))),
      stereo_right_(rightJacobianSO3(deviation.segment<3>(kStereoRotation))),
      baseline_(baselineAxes(given.rightFromLeft().inverse())) {
  for (size_t c = 0; c < 2; ++c)
    for (int i = 0; i < kRadialShifts; ++i)
      shifted_[c][i] = withRadialShift(calibration_.cameras[c].model, given.cameras[c].model,
                                       kShiftStep * RadialShift::Unit(i));
}

CalibrationJacobian CalibrationDerivatives::operator()(size_t camera,
                                                       const ReprojectionMeasurement& measurement,
                                                       const SE3& T_HT,
                                                       const InverseDepthLandmark& landmark) const {
  CalibrationJacobian J = CalibrationJacobian::Zero();
  const double rho = landmark.parameters.z();
  const Eigen::Vector3d ray_B =
      T_HT.R.transpose() * (landmark.axes * landmark.parameters.head<2>().homogeneous() +
                            rho * (landmark.origin - T_HT.t));
  const SE3& T_BC0 = calibration_.cameras[0].T_BC;
  const Eigen::Vector3d ray_C0 = T_BC0.R.transpose() * (ray_B - rho * T_BC0.t);
  const Eigen::Vector3d ray_C =
      camera == 0 ? ray_C0 : Eigen::Vector3d(T_C0C1_.R.transpose() * (ray_C0 - rho * T_C0C1_.t));
  const Eigen::Vector3d ray_M = measurement.R_MC * ray_C;
  if (!(ray_M.z() > 0.0)) return J;
  const Eigen::Vector2d xy = ray_M.head<2>() / ray_M.z();
  Eigen::Matrix<double, 2, 3> J_M;
  J_M.leftCols<2>() = measurement.sqrt_information / ray_M.z();
  J_M.col(2) = -(J_M.leftCols<2>() * xy);
  const Eigen::Matrix<double, 2, 3> J_C = J_M * measurement.R_MC;  // by the ray in this camera
  Eigen::Matrix<double, 2, 3> J_C0 = J_C;                          // by the ray in the left one
  if (camera == 1) {
    J_C0 = J_C * T_C0C1_.R.transpose();
    J.middleCols<3>(kStereoRotation) = J_C * hat(ray_C) * stereo_right_;
    J.middleCols<3>(kBaseline) = -rho * J_C0 * baseline_;
  }
  J.middleCols<3>(kCameraRotation) = J_C0 * hat(ray_C0) * camera_right_;
  J.middleCols<3>(kCameraPosition) = -rho * J_C0 * T_BC0.R.transpose();
  const CameraModel& model = calibration_.cameras[camera].model;
  const auto pixel = model.project(measurement.ray());
  if (!pixel) return J;
  const double per_pixel = inverseSigma(model, measurement);
  const auto c = static_cast<Eigen::Index>(camera);
  // Of the predicted pixel: the measured one's noise is in the residual, too, and a focal length
  // that shrinks the noise would look better than it is.
  const Eigen::Vector2d r = measurement.sqrt_information * (xy - measurement.xy);
  J.col(kFocal + c) =
      (per_pixel * (*pixel - model.principalPoint()) + r) / (1.0 + deviation_[kFocal + c]);
  J.middleCols<2>(kPrincipalPoint + 2 * c) = per_pixel * Eigen::Matrix2d::Identity();
  J.middleCols<kRadialShifts>(kRadialDistortion + kRadialShifts * c) =
      per_pixel * pixelByShift(model, shifted_[camera], ray_C);
  return J;
}

}  // namespace etalon::fixed_lag
