#pragma once

/*
 * Shared error: the pose that the cameras see against that of the body. They differ by the turn of
 * the cameras in the body against the calibration, and by the error that all pixels of a frame
 * share. Private to the module.
 *
 * Frames      W world, B body, S the body as the cameras see it.
 * Parameters  T_WB, T_WS (7 each, PoseManifold), the turn t (3, rad, axes of the body).
 * Residual    6 x 1, [rotation, position]:
 *               r = ((Log(R_WB^T R_WS) - t) / sigma_rad,  w (p_S - p_B))
 * Whitening   sigma_rad an axis; the positions are the same, which the gauge's weight w says.
 * Jacobians   right perturbations of both rotations; positions additive.
 * Leaves out  a translation that pixels share, and errors of the two cameras against each other.
 */

#include <ceres/sized_cost_function.h>

#include "etalon/core/so3.h"
#include "residuals/gauge_cost.h"
#include "residuals/pose_manifold.h"

namespace etalon {

class SharedErrorCost : public ceres::SizedCostFunction<6, 7, 7, 3> {
 public:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  explicit SharedErrorCost(double sigma_rad) : inverse_sigma_(inverseSigma(sigma_rad)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const SE3 body = fromBlock(parameters[0]), seen = fromBlock(parameters[1]);
    const Eigen::Matrix3d R = body.R.transpose() * seen.R;
    const Eigen::Vector3d off = logSO3(R), turn(parameters[2]);
    Vector6d r;
    r << off - turn, seen.t - body.t;
    Eigen::Map<Vector6d>{residuals} = inverse_sigma_.cwiseProduct(r);
    if (!jacobians) return true;
    Matrix6d by_seen = Matrix6d::Identity();
    by_seen.topLeftCorner<3, 3>() = rightJacobianInverseSO3(off);
    by_seen = inverse_sigma_.asDiagonal() * by_seen;
    if (jacobians[0]) {
      Matrix6d by_body = -by_seen;
      by_body.topLeftCorner<3, 3>() *= R.transpose();
      writePoseJacobian(by_body, parameters[0], jacobians[0]);
    }
    if (jacobians[1]) writePoseJacobian(by_seen, parameters[1], jacobians[1]);
    if (jacobians[2]) {
      Eigen::Map<Eigen::Matrix<double, 6, 3, Eigen::RowMajor>> by_turn(jacobians[2]);
      by_turn.setZero();
      by_turn.diagonal() = -inverse_sigma_.head<3>();
    }
    return true;
  }

  /** Whitening, order [rotation, position]. */
  static Vector6d inverseSigma(double sigma_rad) {
    Vector6d inverse_sigma;
    inverse_sigma << Eigen::Vector3d::Constant(1.0 / sigma_rad),
        Eigen::Vector3d::Constant(GaugeCost::kInverseSigma);
    return inverse_sigma;
  }

 private:
  Vector6d inverse_sigma_;
};

}  // namespace etalon
