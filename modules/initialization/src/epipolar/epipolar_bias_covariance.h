#pragma once

// The covariance of the gyro bias from normal epipolar constraints. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "epipolar/epipolar_pairs.h"
#include "etalon/core/calibration.h"
#include "etalon/initialization/steps/gyro_bias_errors.h"

namespace etalon {

/**
 * Covariance of the minimiser of a sum of pairs' costs by propagating the noise of what goes in,
 * not from the cost's curvature alone: an observation takes part in many pairs, and so does the
 * gyro's noise of an interval. With H the Gauss-Newton information and g its gradient,
 *   H^-1 ( sum over observations dg/df P_f dg/df^T + sum over intervals dg/dphi C dg/dphi^T ) H^-1
 * at fixed weights. The translations are eliminated pair by pair.
 */
class EpipolarBiasCovariance {
 public:
  /**
   * @param intervals between neighbouring keyframes
   * @param observations their numbers are below that
   */
  EpipolarBiasCovariance(const StereoInertialCalibration& calibration, double sigma_px,
                         size_t intervals, size_t observations)
      : calibration_(calibration),
        sigma_px_(sigma_px),
        by_gyro_(intervals, Eigen::Matrix3d::Zero()),
        observations_(observations) {}

  /**
   * @param R R_CiCj, and its derivative by the bias: R(b + d) = R Exp(A d)
   * @param by_interval the same by the right perturbation of dR_k, for k = i .. j-1
   * @param rotation_only the pair's cost is rotationOnlyCost()
   */
  void add(const EpipolarPair& pair, const Eigen::Matrix3d& R, const Eigen::Matrix3d& A,
           const std::vector<Eigen::Matrix3d>& by_interval, bool rotation_only);

  const Eigen::Matrix3d& information() const { return H_; }

  GyroBiasErrors errors() const;

 private:
  /** Derivative of the gradient by an observation's bearing. */
  struct Observation {
    int camera = 0;
    Eigen::Vector3d f = Eigen::Vector3d::UnitZ();
    Eigen::Matrix3d by_bearing = Eigen::Matrix3d::Zero();
  };

  const StereoInertialCalibration& calibration_;
  double sigma_px_;
  Eigen::Matrix3d H_ = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Matrix3d> by_gyro_;
  std::vector<Observation> observations_;  ///< by number
};

}  // namespace etalon
