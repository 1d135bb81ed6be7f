#pragma once

// etalon/optimization/residuals/reprojection_residual.h for Ceres, with the landmark as bearing and
// inverse depth. Private to the module.
//
// Blocks      T_WB (7, PoseManifold), (a, b, rho) of the landmark (3).
// Leaves out  robust loss (the problem's). A landmark behind the camera counts as a gross outlier
//             that nothing moves, so that it costs its own residual and not the step.

#include <ceres/sized_cost_function.h>

#include "etalon/optimization/residuals/reprojection_residual.h"
#include "residuals/pose_manifold.h"

namespace etalon {

/** Norm of a whitened pixel residual beyond which a measurement is wrong, whatever the poses. */
constexpr double kGrossOutlier = 30.0;

class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  /** @param landmark gives origin and axes; @param held where true, rho is a constant */
  ReprojectionCost(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                   const InverseDepthLandmark& landmark, const char& held)
      : T_CB_(T_CB), measurement_(measurement), landmark_(landmark), held_(held) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 6> J_pose;
    Eigen::Matrix<double, 2, 3> J_landmark;
    const bool derive = jacobians != nullptr;
    InverseDepthLandmark landmark = landmark_;
    landmark.parameters = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    if (!reprojectionResidual(T_CB_, measurement_, fromBlock(parameters[0]), landmark, &r,
                              derive ? &J_pose : nullptr, derive ? &J_landmark : nullptr)) {
      r = {kGrossOutlier, 0.0};
      J_pose.setZero();
      J_landmark.setZero();
    }
    Eigen::Map<Eigen::Vector2d>{residuals} = r;
    if (!derive) return true;
    if (jacobians[0]) writePoseJacobian(J_pose, parameters[0], jacobians[0]);
    if (jacobians[1]) {
      if (held_) J_landmark.col(2).setZero();
      Eigen::Map<RowMajor<2, 3>>{jacobians[1]} = J_landmark;
    }
    return true;
  }

 private:
  const SE3& T_CB_;
  const ReprojectionMeasurement& measurement_;
  const InverseDepthLandmark& landmark_;
  const char& held_;
};

}  // namespace etalon
