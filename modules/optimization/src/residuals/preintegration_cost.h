#pragma once

// etalon/optimization/residuals/preintegration_residual.h for Ceres. Private to the module.
//
// Blocks      T_WBi (7, PoseManifold), v_i (3), T_WBj (7), v_j (3), [b_g, b_a] (6), and, if there are
//             any, the modes of the accelerometer's slow error (3 each), which adds to b_a.
// Whitening   sqrtInformation(): the first three rows are the gyro's.
// Leaves out  gravity is fixed; robust loss (the problem's).

#include <ceres/cost_function.h>

#include <utility>

#include "etalon/optimization/residuals/preintegration_residual.h"
#include "residuals/pose_manifold.h"

namespace etalon {

class PreintegrationCost : public ceres::CostFunction {
 public:
  /**
   * @param preintegration outlives this
   * @param slow_modes m/s^2 of slow error in this interval a unit of every mode
   * @param accel_noise_factor standard deviation of the accelerometer's white noise over that of the
   *     preintegration
   */
  PreintegrationCost(const Preintegration& preintegration, const Eigen::Vector3d& g_W,
                     Eigen::VectorXd slow_modes = {}, double accel_noise_factor = 1.0)
      : preintegration_(preintegration),
        L_(sqrtInformation(preintegration)),
        g_W_(g_W),
        slow_modes_(std::move(slow_modes)) {
    L_.bottomRows<6>() /= accel_noise_factor;  // given the rotation's, they are the accelerometer's
    set_num_residuals(9);
    *mutable_parameter_block_sizes() = {7, 3, 7, 3, 6};
    if (slow_modes_.size() > 0)
      mutable_parameter_block_sizes()->push_back(static_cast<int>(3 * slow_modes_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Eigen::Map;
    using Eigen::Vector3d;
    const Eigen::Index modes = slow_modes_.size();
    ImuBias bias{Map<const Vector3d>(parameters[4]), Map<const Vector3d>(parameters[4] + 3)};
    if (modes > 0) bias.accel += Map<const Eigen::Matrix3Xd>(parameters[5], 3, modes) * slow_modes_;
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
    if (modes > 0 && jacobians[5]) {
      Map<RowMajor<9, Eigen::Dynamic>> by_modes(jacobians[5], 9, 3 * modes);
      for (Eigen::Index m = 0; m < modes; ++m)
        by_modes.middleCols<3>(3 * m) = slow_modes_[m] * L_ * J.bias_accel;
    }
    return true;
  }

 private:
  const Preintegration& preintegration_;
  Eigen::Matrix<double, 9, 9> L_;
  Eigen::Vector3d g_W_;
  Eigen::VectorXd slow_modes_;
};

}  // namespace etalon
