#pragma once

// etalon/optimization/residuals/inertial_residual.h for Ceres. Private to the module.
//
// Blocks      T_WBi (7, PoseManifold), [v, b_g, b_a] of i (9), T_WBj (7), [v, b_g, b_a] of j (9).
// Whitening   inertialSqrtInformation().
// Leaves out  gravity is fixed; robust loss (the problem's).

#include <ceres/sized_cost_function.h>

#include "etalon/optimization/residuals/inertial_residual.h"
#include "residuals/pose_manifold.h"

namespace etalon {

/** Velocity (m/s, in W), b_g (rad/s), b_a (m/s^2). */
using MotionBlock = std::array<double, 9>;

inline MotionBlock toMotionBlock(const NavState& state) {
  MotionBlock block;
  Eigen::Map<Eigen::Matrix<double, 9, 1>>{block.data()} << state.v_WB, state.bias.gyro,
      state.bias.accel;
  return block;
}

inline NavState toNavState(const double* pose, const double* motion) {
  NavState state;
  state.T_WB = fromBlock(pose);
  state.v_WB = Eigen::Map<const Eigen::Vector3d>(motion);
  state.bias.gyro = Eigen::Map<const Eigen::Vector3d>(motion + 3);
  state.bias.accel = Eigen::Map<const Eigen::Vector3d>(motion + 6);
  return state;
}

class InertialCost : public ceres::SizedCostFunction<15, 7, 9, 7, 9> {
 public:
  using Matrix15d = Eigen::Matrix<double, 15, 15>;

  /** @param preintegration outlives this */
  InertialCost(const Preintegration& preintegration, const Eigen::Vector3d& g_W)
      : preintegration_(preintegration), L_(inertialSqrtInformation(preintegration)), g_W_(g_W) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Matrix15d J[2];
    const Eigen::Matrix<double, 15, 1> r =
        inertialResidual(preintegration_, toNavState(parameters[0], parameters[1]),
                         toNavState(parameters[2], parameters[3]), g_W_,
                         jacobians ? &J[0] : nullptr, jacobians ? &J[1] : nullptr);
    Eigen::Map<Eigen::Matrix<double, 15, 1>>{residuals} = L_ * r;
    if (!jacobians) return true;
    for (size_t side = 0; side < 2; ++side) {
      const size_t pose = 2 * side, motion = pose + 1;
      if (jacobians[pose])
        writePoseJacobian<15>(L_ * J[side].leftCols<6>(), parameters[pose], jacobians[pose]);
      if (jacobians[motion])
        Eigen::Map<RowMajor<15, 9>>{jacobians[motion]} = L_ * J[side].rightCols<9>();
    }
    return true;
  }

 private:
  const Preintegration& preintegration_;
  Matrix15d L_;
  Eigen::Vector3d g_W_;
};

}  // namespace etalon
