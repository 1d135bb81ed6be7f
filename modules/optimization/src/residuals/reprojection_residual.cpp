#include "etalon/optimization/residuals/reprojection_residual.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "etalon/core/so3.h"

namespace etalon {

std::optional<ReprojectionMeasurement> makeMeasurement(const CameraModel& camera,
                                                       const Eigen::Vector2d& pixel,
                                                       double sigma_px) {
  ReprojectionMeasurement measurement;
  const auto direction = camera.measure(pixel, &measurement.sqrt_information);
  if (!direction) return std::nullopt;
  static_cast<MeasuredDirection&>(measurement) = *direction;
  measurement.sqrt_information /= sigma_px;
  return measurement;
}

namespace {

/**
 * Residual of the homogeneous point [p_W; 1] rho, which may be at infinity.
 * @param ray_W rho (p_W - t_WB)
 * @param J_ray if given: d(r)/d(ray_W); T_CB.t takes part in rho alone
 */
bool homogeneousResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                         const SE3& T_WB, const Eigen::Vector3d& ray_W, double rho,
                         Eigen::Vector2d* r, Eigen::Matrix<double, 2, 6>* J_pose,
                         Eigen::Matrix<double, 2, 3>* J_ray, Eigen::Vector2d* J_baseline) {
  const Eigen::Vector3d ray_B = T_WB.R.transpose() * ray_W;
  Eigen::Matrix<double, 2, 3> J_C;
  if (!reprojectionResidual(measurement, T_CB.R * ray_B + rho * T_CB.t, rho, r,
                            J_pose || J_ray ? &J_C : nullptr))
    return false;
  if (!J_pose && !J_ray) return true;

  const Eigen::Matrix<double, 2, 3> J_B = J_C * T_CB.R;
  const Eigen::Matrix<double, 2, 3> J_W = J_B * T_WB.R.transpose();
  if (J_pose) {
    J_pose->leftCols<3>().noalias() = J_B * hat(ray_B);
    J_pose->rightCols<3>() = -rho * J_W;
  }
  if (J_ray) *J_ray = J_W;
  if (J_baseline) J_baseline->noalias() = J_C * T_CB.t;
  return true;
}

}  // namespace

bool reprojectionResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                          const SE3& T_WB, const Eigen::Vector3d& p_W, Eigen::Vector2d* r,
                          Eigen::Matrix<double, 2, 6>* J_pose,
                          Eigen::Matrix<double, 2, 3>* J_landmark) {
  return homogeneousResidual(T_CB, measurement, T_WB, p_W - T_WB.t, 1.0, r, J_pose, J_landmark,
                             nullptr);
}

InverseDepthLandmark::InverseDepthLandmark(const Eigen::Vector3d& p_W, const Eigen::Vector3d& about)
    : origin(about) {
  const Eigen::Vector3d ray = p_W - about;
  const double distance = ray.norm();
  if (!(distance > 0.0)) return;
  axes << tangentBasis(ray), ray / distance;
  parameters.z() = 1.0 / distance;
}

Eigen::Vector3d InverseDepthLandmark::position() const {
  const Eigen::Vector3d ray = axes * parameters.head<2>().homogeneous();
  return origin + ray / std::max(parameters.z(), ray.norm() / kFarthestLandmark);
}

bool reprojectionResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                          const SE3& T_WB, const InverseDepthLandmark& landmark, Eigen::Vector2d* r,
                          Eigen::Matrix<double, 2, 6>* J_pose,
                          Eigen::Matrix<double, 2, 3>* J_landmark) {
  const double rho = landmark.parameters.z();
  const Eigen::Vector3d to_origin = landmark.origin - T_WB.t;
  const Eigen::Vector3d ray_W =
      landmark.axes * landmark.parameters.head<2>().homogeneous() + rho * to_origin;
  Eigen::Matrix<double, 2, 3> J_ray;
  Eigen::Vector2d J_baseline;
  if (!homogeneousResidual(T_CB, measurement, T_WB, ray_W, rho, r, J_pose,
                           J_landmark ? &J_ray : nullptr, J_landmark ? &J_baseline : nullptr))
    return false;
  if (J_landmark) {
    J_landmark->leftCols<2>().noalias() = J_ray * landmark.axes.leftCols<2>();
    J_landmark->col(2).noalias() = J_ray * to_origin + J_baseline;
  }
  return true;
}

}  // namespace etalon
