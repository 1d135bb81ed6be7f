#pragma once

/*
 * Gauge: position and yaw of one pose stay where they are. Private to the module.
 *
 * Frames      W world, z up; B body.
 * Parameters  T_WB (7, PoseManifold).
 * Residual    4 x 1, w (p - p_0) and w (Log(R R_0^T))_z: position, and the turn about W's z.
 * Whitening   w = kInverseSigma. A free gauge costs nothing, so any weight gives the same minimum;
 *             this one keeps the normal equations well conditioned beside pixel residuals.
 * Jacobian    right perturbation of the rotation: R Exp(d) R_0^T = Exp(phi) Exp(R_0 d).
 */

#include <ceres/sized_cost_function.h>

#include "etalon/core/so3.h"
#include "residuals/pose_manifold.h"

namespace etalon {

class GaugeCost : public ceres::SizedCostFunction<4, 7> {
 public:
  static constexpr double kInverseSigma = 1e5;  ///< 1/m and 1/rad

  /** @param T_WB the reference, R_0 and p_0 */
  explicit GaugeCost(const SE3& T_WB) : T_WB_(T_WB) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const SE3 T_WB = fromBlock(parameters[0]);
    const Eigen::Vector3d phi = logSO3(T_WB.R * T_WB_.R.transpose());
    Eigen::Map<Eigen::Vector3d>{residuals} = kInverseSigma * (T_WB.t - T_WB_.t);
    residuals[3] = kInverseSigma * phi.z();
    if (jacobians && jacobians[0]) {
      Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
      J.block<3, 3>(0, 3).diagonal().setConstant(kInverseSigma);
      J.block<1, 3>(3, 0) = kInverseSigma * (rightJacobianInverseSO3(phi) * T_WB_.R).row(2);
      writePoseJacobian(J, parameters[0], jacobians[0]);
    }
    return true;
  }

 private:
  SE3 T_WB_;
};

}  // namespace etalon
