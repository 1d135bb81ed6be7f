#pragma once

/*
 * Bias prior: what is believed of the IMU's biases before any measurement. Private to the module.
 *
 * Frames      B, the IMU's axes.
 * Parameters  [b_g (rad/s), b_a (m/s^2)] (6, additive).
 * Residual    6 x 1, in sigmas:  r = (b - mean) / sigma
 * Whitening   one sigma for the gyro's axes, one for the accelerometer's.
 * Jacobian    diag(1 / sigma).
 * Leaves out  correlations between axes.
 */

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "etalon/imu/bias_priors.h"

namespace etalon {

class BiasPriorCost : public ceres::SizedCostFunction<6, 6> {
 public:
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  explicit BiasPriorCost(const BiasPriors& priors) {
    mean_ << priors.mean.gyro, priors.mean.accel;
    inverse_sigma_ << Eigen::Vector3d::Constant(1.0 / priors.sigma_gyro_rps),
        Eigen::Vector3d::Constant(1.0 / priors.sigma_accel_mps2);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Vector6d>{residuals} =
        inverse_sigma_.cwiseProduct(Eigen::Map<const Vector6d>(parameters[0]) - mean_);
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>{jacobians[0]} =
          inverse_sigma_.asDiagonal();
    return true;
  }

 private:
  Vector6d mean_, inverse_sigma_;
};

}  // namespace etalon
