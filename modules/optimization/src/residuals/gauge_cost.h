#pragma once

/*
 * Gauge: position and yaw of one pose stay where they are. Private to the module.
 *
 * Frames      W world, z up; B body.
 * Parameters  T_WB (7, PoseManifold).
 * Residual    4 x 1, w (p - p_0) and w (Log(R R_0^T))_z: position, and the turn about W's z.
 * Whitening   w = kGaugeInverseSigma. A free gauge costs nothing, so any weight gives the same minimum;
 *             this one keeps the normal equations well conditioned beside pixel residuals.
 * Jacobian    right perturbation of the rotation: R Exp(d) R_0^T = Exp(phi) Exp(R_0 d).
 */

#include <ceres/sized_cost_function.h>

#include "etalon/core/so3.h"
#include "residuals/pose_manifold.h"

namespace etalon {

constexpr double kGaugeInverseSigma = 1e5;  ///< 1/m and 1/rad

/** @param reference R_0 and p_0 @param J derivatives by [rotation, position], if not null */
inline Eigen::Vector4d gaugeResidual(const SE3& T_WB, const SE3& reference,
                                     Eigen::Matrix<double, 4, 6>* J = nullptr) {
  const Eigen::Vector3d phi = logSO3(T_WB.R * reference.R.transpose());
  if (J) {
    J->setZero();
    J->block<3, 3>(0, 3).diagonal().setConstant(kGaugeInverseSigma);
    J->block<1, 3>(3, 0) = kGaugeInverseSigma * (rightJacobianInverseSO3(phi) * reference.R).row(2);
  }
  Eigen::Vector4d r;
  r << T_WB.t - reference.t, phi.z();
  return kGaugeInverseSigma * r;
}

/** The same for Ceres. */
class GaugeCost : public ceres::SizedCostFunction<4, 7> {
 public:
  explicit GaugeCost(const SE3& reference) : reference_(reference) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool derive = jacobians && jacobians[0];
    Eigen::Matrix<double, 4, 6> J;
    Eigen::Map<Eigen::Vector4d>{residuals} =
        gaugeResidual(fromBlock(parameters[0]), reference_, derive ? &J : nullptr);
    if (derive) writePoseJacobian(J, parameters[0], jacobians[0]);
    return true;
  }

 private:
  SE3 reference_;
};

}  // namespace etalon
