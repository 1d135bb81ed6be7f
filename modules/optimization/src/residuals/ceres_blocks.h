#pragma once

// Adapters from this module's residuals to Ceres. Private to the module.

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <array>

#include "etalon/core/se3.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon {

/** Norm of a whitened pixel residual beyond which a measurement is wrong, whatever the poses. */
constexpr double kGrossOutlier = 30.0;

/** A pose as Ceres sees it: quaternion (x, y, z, w), position. */
using PoseBlock = std::array<double, 7>;

PoseBlock toBlock(const SE3& T_WB);
SE3 fromBlock(const double* block);

/**
 * Right perturbation of a PoseBlock: R Exp(d), p + t; tangent 6. The cost functions below write
 * their Jacobians with respect to the tangent into the first six of the seven ambient columns;
 * PlusJacobian is therefore [I; 0].
 */
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/**
 * reprojectionResidual with blocks (pose 7, landmark's (a, b, rho) 3). A landmark behind the camera
 * counts as a gross outlier that nothing moves, so that it costs its own residual and not the step.
 */
class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  /** @param landmark gives origin and axes; @param held where true, rho is a constant */
  ReprojectionCost(const SE3& T_CB, const ReprojectionMeasurement& measurement,
                   const InverseDepthLandmark& landmark, const char& held)
      : T_CB_(T_CB), measurement_(measurement), landmark_(landmark), held_(held) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const SE3& T_CB_;
  const ReprojectionMeasurement& measurement_;
  const InverseDepthLandmark& landmark_;
  const char& held_;
};

/** Whitened preintegrationResidual with blocks (pose_i 7, v_i 3, pose_j 7, v_j 3, [b_g, b_a] 6);
 * gravity fixed. */
class PreintegrationCost : public ceres::SizedCostFunction<9, 7, 3, 7, 3, 6> {
 public:
  PreintegrationCost(const Preintegration& preintegration, const Eigen::Vector3d& g_W)
      : preintegration_(preintegration), L_(sqrtInformation(preintegration)), g_W_(g_W) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Preintegration& preintegration_;
  Eigen::Matrix<double, 9, 9> L_;
  Eigen::Vector3d g_W_;
};

/** Gaussian prior on [b_g, b_a], diagonal. */
class BiasPriorCost : public ceres::SizedCostFunction<6, 6> {
 public:
  BiasPriorCost(const ImuBias& mean, double sigma_gyro_rps, double sigma_accel_mps2);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Matrix<double, 6, 1> mean_, inverse_sigma_;
};

/**
 * The pose that the cameras see against that of the body, blocks (body 7, seen 7): they differ by a
 * rotation of `sigma_rad` an axis. That is the error that all pixels of a frame share. The
 * positions are the same.
 */
class SharedErrorCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit SharedErrorCost(double sigma_rad);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /** Whitening, order [rotation, position]. */
  const Eigen::Matrix<double, 6, 1>& inverseSigma() const { return inverse_sigma_; }

 private:
  Eigen::Matrix<double, 6, 1> inverse_sigma_;
};

/**
 * Holds the gauge: position and yaw of one pose. A free gauge costs nothing, so any weight gives
 * the same minimum; this one keeps the normal equations well conditioned beside pixel residuals.
 */
class GaugeCost : public ceres::SizedCostFunction<4, 7> {
 public:
  explicit GaugeCost(const SE3& T_WB) : T_WB_(T_WB) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  static constexpr double kInverseSigma = 1e5;  ///< 1/m and 1/rad

 private:
  SE3 T_WB_;
};

}  // namespace etalon
