#include "etalon/optimization/reprojection_residual.h"

#include "etalon/core/so3.h"

namespace etalon {

std::optional<ReprojectionMeasurement> makeMeasurement(const PinholeRadtan& camera,
                                                       const Eigen::Vector2d& pixel,
                                                       double sigma_px) {
  const std::optional<Eigen::Vector2d> xy = camera.pixelToNormalized(pixel);
  if (!xy) return std::nullopt;
  ReprojectionMeasurement measurement;
  measurement.xy = *xy;
  camera.normalizedToPixel(*xy, &measurement.sqrt_information);
  measurement.sqrt_information /= sigma_px;
  return measurement;
}

bool reprojectionResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                          const SE3& T_WB, const Eigen::Vector3d& p_W, Eigen::Vector2d* r,
                          Eigen::Matrix<double, 2, 6>* J_pose,
                          Eigen::Matrix<double, 2, 3>* J_landmark) {
  constexpr double kMinDepth = 0.01;  // m
  const Eigen::Vector3d p_B = T_WB.R.transpose() * (p_W - T_WB.t);
  const Eigen::Vector3d p_C = T_CB.R * p_B + T_CB.t;
  if (!(p_C.z() > kMinDepth)) return false;
  const double inv_z = 1.0 / p_C.z();
  const Eigen::Vector2d xy = p_C.head<2>() * inv_z;
  *r = measurement.sqrt_information * (xy - measurement.xy);
  if (!J_pose && !J_landmark) return true;

  Eigen::Matrix<double, 2, 3> J_C;  // d(r)/d(p_C)
  J_C.leftCols<2>() = measurement.sqrt_information * inv_z;
  J_C.col(2).noalias() = -(J_C.leftCols<2>() * xy);
  const Eigen::Matrix<double, 2, 3> J_B = J_C * T_CB.R;
  const Eigen::Matrix<double, 2, 3> J_W = J_B * T_WB.R.transpose();
  if (J_pose) {
    J_pose->leftCols<3>().noalias() = J_B * hat(p_B);
    J_pose->rightCols<3>() = -J_W;
  }
  if (J_landmark) *J_landmark = J_W;
  return true;
}

}  // namespace etalon
