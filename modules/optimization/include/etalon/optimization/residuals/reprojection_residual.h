#pragma once

/*
 * Reprojection residual: where a landmark is seen by one camera of the rig against where it was
 * measured.
 *
 * Frames      W world (or V, the frame of the stereo odometry), B body, C camera, M the
 *             measurement's own, which is C turned: for perspective cameras C itself, else with its z
 *             axis along the measured ray.
 * Parameters  T_WB pose of the body (6: rotation by right perturbation R Exp(d), position additive
 *             in W), p_W landmark (3, additive, m).
 * Residual    2 x 1, in sigmas of a pixel:
 *               p_M = R_MC T_CB T_WB^-1 p_W
 *               r = S (p_M.xy / p_M.z - m)
 *             with m the measured pixel as direction in M, computed once.
 * Whitening   S = (1 / sigma_px) d(pixel)/d(xy) at m, so that |r| is the distance in the distorted
 *             image in units of sigma_px, to first order in the residual. (Distorting the prediction
 *             instead costs three times as much and changes r by less than 1 % for residuals under
 *             10 px.)
 * Jacobians   right perturbation of the rotation; everything else additive.
 * Leaves out  a landmark behind the camera, or more than 90 degrees from the measured ray of a
 *             fisheye (returns false); robust loss (the caller's).
 * Reference   Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, eq. (3), with the two cameras of an
 *             unrectified rig as two residuals.
 */

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "etalon/core/camera_model.h"
#include "etalon/core/se3.h"

namespace etalon {

/** A measured pixel in the form that the residual wants: its direction and how precise that is. */
struct ReprojectionMeasurement : MeasuredDirection {
  Eigen::Matrix2d sqrt_information = Eigen::Matrix2d::Identity();  ///< S
};

/** Nothing if the camera shows nothing at the pixel. */
std::optional<ReprojectionMeasurement> makeMeasurement(const CameraModel& camera,
                                                       const Eigen::Vector2d& pixel,
                                                       double sigma_px);

/**
 * The residual of a point given in the camera's axes, in homogeneous coordinates [p_C; 1] rho, so
 * that it may be at infinity.
 * @return false if the point is less than 1 cm from the camera along M's z axis; outputs are then
 * untouched
 * @param ray_C rho p_C
 * @param J_ray if given: d(r)/d(ray_C), 2x3
 */
inline bool reprojectionResidual(const ReprojectionMeasurement& measurement,
                                 const Eigen::Vector3d& ray_C, double rho, Eigen::Vector2d* r,
                                 Eigen::Matrix<double, 2, 3>* J_ray = nullptr) {
  constexpr double kMinDepth = 0.01;  // m
  const Eigen::Vector3d ray_M = measurement.R_MC * ray_C;
  if (!(ray_M.z() > std::max(0.0, kMinDepth * rho))) return false;
  const double inv_z = 1.0 / ray_M.z();
  const Eigen::Vector2d xy = ray_M.head<2>() * inv_z;
  *r = measurement.sqrt_information * (xy - measurement.xy);
  if (!J_ray) return true;
  Eigen::Matrix<double, 2, 3> J_M;  // d(r)/d(ray_M)
  J_M.leftCols<2>() = measurement.sqrt_information * inv_z;
  J_M.col(2).noalias() = -(J_M.leftCols<2>() * xy);
  J_ray->noalias() = J_M * measurement.R_MC;
  return true;
}

/**
 * @return false if the landmark is less than 1 cm from the camera along M's z axis; outputs are
 * then untouched
 * @param J_pose if given: d(r)/d[rotation, position], 2x6
 * @param J_landmark if given: d(r)/d(p_W), 2x3
 */
bool reprojectionResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                          const SE3& T_WB, const Eigen::Vector3d& p_W, Eigen::Vector2d* r,
                          Eigen::Matrix<double, 2, 6>* J_pose = nullptr,
                          Eigen::Matrix<double, 2, 3>* J_landmark = nullptr);

/** No landmark is farther, m: its parallax over a metre is 0.005 px. What is at infinity is
 * reported as a point at this distance. */
constexpr double kFarthestLandmark = 1e5;

/**
 * A landmark as bearing and inverse depth about a point of W that stays where it is,
 *   p_W = origin + axes (a, b, 1)^T / rho,
 * in whose parameters (a, b, rho) the residual is nearly linear at any distance; rho = 0 is a
 * landmark at infinity, which tells of rotations alone (Civera, Davison and Montiel, Inverse Depth
 * Parametrization for Monocular SLAM, TRO 2008, with a fixed origin).
 */
struct InverseDepthLandmark {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();           ///< the third along the bearing
  Eigen::Vector3d parameters = Eigen::Vector3d(0.0, 0.0, 1.0);  ///< a, b, rho (1/m)

  InverseDepthLandmark() = default;
  /** The landmark p_W about the origin `about`. */
  InverseDepthLandmark(const Eigen::Vector3d& p_W, const Eigen::Vector3d& about);

  /** p_W; at kFarthestLandmark if it is farther or rho is negative. */
  Eigen::Vector3d position() const;
};

/** The same residual of such a landmark; @param J_landmark d(r)/d(a, b, rho). */
bool reprojectionResidual(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                          const SE3& T_WB, const InverseDepthLandmark& landmark, Eigen::Vector2d* r,
                          Eigen::Matrix<double, 2, 6>* J_pose = nullptr,
                          Eigen::Matrix<double, 2, 3>* J_landmark = nullptr);

}  // namespace etalon
