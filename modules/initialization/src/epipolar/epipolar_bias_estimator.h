#pragma once

// The gyro bias from normal epipolar constraints: the solver. Private to the module.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "epipolar/epipolar_pairs.h"
#include "etalon/core/calibration.h"
#include "etalon/imu/preintegration.h"
#include "etalon/initialization/steps/normal_epipolar.h"
#include "etalon/initialization/steps/normal_epipolar_bias.h"

namespace etalon {

/**
 * Estimates the gyro bias of a window from one seed: the schedule of reweighted rounds that
 * estimateGyroBias() describes. What is passed to the constructor must outlive it.
 */
class EpipolarBiasEstimator {
 public:
  EpipolarBiasEstimator(const StereoInertialCalibration& calibration,
                        const std::vector<const TrackedFrame*>& keyframes,
                        const std::vector<Preintegration>& preintegrations,
                        const NormalEpipolarBiasOptions& options);

  /** Whether all pairs of the longest span and their halves show no movement, of whatever kind: of
   * neighbours alone that is every pair of the window. */
  bool atRest();
  /** From now on the costs are rotationOnlyCost(). */
  void useRotationOnly() { rotation_only_ = true; }

  /** The whole schedule from `seed`; returns b_g, rad/s. */
  Eigen::Vector3d solve(const Eigen::Vector3d& seed);

  int longestSpan() const { return pairs_.back().j - pairs_.back().i; }
  /** Median of the pairs' robust standard deviations. */
  double noise(int span) const;
  /** Of a pair of neighbours, in the camera that sees more. */
  int fewestMatches() const { return fewest_matches_; }
  /** Sets errors and covariance of its bias, at the weights and directions that the schedule has
   * left. @return the information */
  Eigen::Matrix3d fillErrors(NormalEpipolarBias* result);
  /** Sets the summary and what concerns the matches. */
  void describe(NormalEpipolarBias* result) const;

 private:
  /**
   * How a round weights the matches: at the start, where no direction of translation is known, by
   * the length of the normal, so that long ones do not outvote the others; then by the residual.
   */
  enum class Weights { kStart, kCauchy, kTukey };

  struct Linearization {
    double cost = 0.0;
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  };

  struct Relative {
    Eigen::Matrix3d R;       // R_BiBj
    Eigen::Matrix3d dR_dbg;  // R(b_g + d) = R Exp(dR_dbg d)
  };

  /** Sum over the pairs of at most this span; leaves the directions of translation in them. */
  Linearization linearize(const Eigen::Vector3d& b_g, int span, bool with_derivatives = true);
  /** Residuals in the directions that the pairs have, then moments with their weights. */
  void reweight(const Eigen::Vector3d& b_g, int span, Weights weights);
  /** Levenberg-Marquardt at weights that belong to `start`. */
  Eigen::Vector3d round(const Eigen::Vector3d& start, int span, Weights weights);

  void integrateRotations(const Eigen::Vector3d& b_g, int span);
  const Relative& relative(int i, int j) const {
    return relative_[i * (preintegrations_.size() + 1) + j];
  }
  const Relative& relative(const EpipolarPair& pair) const { return relative(pair.i, pair.j); }
  Eigen::Matrix3d rotation(const EpipolarPair& pair) const;  // R_CiCj
  EpipolarCost costOf(const EpipolarPair& pair, const Eigen::Matrix3d& R) const;
  void fillResiduals(EpipolarPair* pair, const Eigen::Matrix3d& R, bool rotation_only) const;
  void fillMoments(EpipolarPair* pair, const Eigen::Matrix3d& R, Weights weights) const;

  const StereoInertialCalibration& calibration_;
  const NormalEpipolarBiasOptions& options_;
  std::vector<Preintegration> preintegrations_;
  std::array<Eigen::Matrix3d, 2> R_BC_;
  std::array<double, 2> sigma_rad_{};
  std::vector<EpipolarPair> pairs_;  ///< by increasing span
  std::vector<Relative> relative_;
  bool rotation_only_ = false;
  int fewest_matches_ = 0;
  int observations_ = 0;
  SolverSummary summary_;  ///< of the last solve(); iterations of all
};

}  // namespace etalon
