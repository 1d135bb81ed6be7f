#pragma once

/*
 * Prior of the turn of the cameras in the body against the calibration. Private to the module.
 *
 * Frames      B, the body's axes.
 * Parameters  the turn t (3, additive, rad).
 * Residual    3 x 1, in sigmas:  r = t / sigma_rad
 * Whitening   one sigma for the three axes.
 * Jacobian    I / sigma_rad.
 */

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace etalon {

class CameraTurnPriorCost : public ceres::SizedCostFunction<3, 3> {
 public:
  explicit CameraTurnPriorCost(double sigma_rad) : inverse_sigma_(1.0 / sigma_rad) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>{residuals} =
        inverse_sigma_ * Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[0]} =
          inverse_sigma_ * Eigen::Matrix3d::Identity();
    return true;
  }

 private:
  double inverse_sigma_;
};

}  // namespace etalon
