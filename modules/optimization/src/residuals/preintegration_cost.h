#pragma once

// etalon/optimization/residuals/preintegration_residual.h for Ceres. Private to the module.
//
// Blocks      T_WBi (7, PoseManifold), v_i (3), T_WBj (7), v_j (3), [b_g, b_a] (6).
// Whitening   sqrtInformation(): the first three rows are the gyro's.
// Leaves out  gravity is fixed; robust loss (the problem's).

#include <ceres/sized_cost_function.h>

#include "etalon/optimization/residuals/preintegration_residual.h"
#include "residuals/pose_manifold.h"

namespace etalon {

class PreintegrationCost : public ceres::SizedCostFunction<9, 7, 3, 7, 3, 6> {
 public:
  /** @param preintegration outlives this */
  PreintegrationCost(const Preintegration& preintegration, const Eigen::Vector3d& g_W)
      : preintegration_(preintegration), L_(sqrtInformation(preintegration)), g_W_(g_W) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Eigen::Map;
    using Eigen::Vector3d;
    const ImuBias bias{Map<const Vector3d>(parameters[4]), Map<const Vector3d>(parameters[4] + 3)};
    PreintegrationJacobians J;
    const Eigen::Matrix<double, 9, 1> r = preintegrationResidual(
        preintegration_, fromBlock(parameters[0]), Map<const Vector3d>(parameters[1]),
        fromBlock(parameters[2]), Map<const Vector3d>(parameters[3]), bias, g_W_,
        jacobians ? &J : nullptr);
    Map<Eigen::Matrix<double, 9, 1>>{residuals} = L_ * r;
    if (!jacobians) return true;
    if (jacobians[0]) writePoseJacobian<9>(L_ * J.pose_i, parameters[0], jacobians[0]);
    if (jacobians[1]) Map<RowMajor<9, 3>>{jacobians[1]} = L_ * J.velocity_i;
    if (jacobians[2]) writePoseJacobian<9>(L_ * J.pose_j, parameters[2], jacobians[2]);
    if (jacobians[3]) Map<RowMajor<9, 3>>{jacobians[3]} = L_ * J.velocity_j;
    if (jacobians[4]) {
      Map<RowMajor<9, 6>> by_bias(jacobians[4]);
      by_bias.leftCols<3>() = L_ * J.bias_gyro;
      by_bias.rightCols<3>() = L_ * J.bias_accel;
    }
    return true;
  }

 private:
  const Preintegration& preintegration_;
  Eigen::Matrix<double, 9, 9> L_;
  Eigen::Vector3d g_W_;
};

}  // namespace etalon
