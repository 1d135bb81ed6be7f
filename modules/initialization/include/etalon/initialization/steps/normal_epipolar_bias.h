#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/imu/preintegration.h"
#include "etalon/initialization/steps/gyro_bias_errors.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

struct NormalEpipolarBiasOptions {
  bool all_pairs = true;       ///< of keyframes; else neighbours only, as published
  bool both_cameras = true;    ///< else the left one only, as published
  bool noise_weighted = true;  ///< eigenvalue relative to the normals' covariance, else published
  int min_matches = 15;        ///< a pair with fewer is left out
  int max_matches = 60;   ///< of keyframes that are not neighbours; more are thinned out evenly
  int rounds = 15;        ///< of reweighting by Tukey's function, at most
  int iterations = 3;     ///< Levenberg-Marquardt iterations of a round, at most
  double sigma_px = 1.0;  ///< standard deviation of a pixel coordinate
  /** Restarts at this distance from the seed if the residuals at the solution are too large, rad/s;
   * 0: none. */
  double restart_rps = 0.1;
};

struct NormalEpipolarBias {
  /** Not started: some neighbours share fewer than min_matches landmarks in a camera. Singular: the
   * normals do not determine the bias. Failed: it is not finite. Costs are at the weights of the
   * first and of the last round. */
  SolverSummary summary;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  ///< b_g, rad/s
  /** Of b_g, (rad/s)^2: the noise of every pixel (sigma_px, times `noise` where that is above 1)
   * and of the gyro, propagated through all pairs in which it takes part. Too small without
   * parallax (pure rotation) and where the normals are not weighted by their noise. */
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  GyroBiasErrors errors;  ///< what `covariance` is made of: the pixels, and the gyro
  /** Median over the pairs of the robust standard deviation of a match's residual, in units of what
   * sigma_px predicts: 1 where the model holds. */
  double noise = 0.0;
  double inlier_share = 0.0;   ///< of the matches: residual under 4 of those standard deviations
  bool rotation_only = false;  ///< at rest: rotationOnlyCost() was used
  int pairs = 0;               ///< of views, a camera each
  int matches = 0;             ///< summed over them
  int fewest_matches = 0;      ///< of a pair of neighbours in their better camera
  int restart = 0;             ///< 0: found from the seed; else the number of the restart
};

/**
 * Gyro bias from the normal epipolar constraints of a window: minimises the sum over pairs of views
 * of smallestEigenvalueCost() at R_CiCj = R_BC^T dR_ij(b_g) R_BC (Kneip and Lynen, ICCV 2013; for
 * the bias: Wang et al., ICRA 2024; He et al., CVPR 2023).
 *
 * Instead of RANSAC, a fixed schedule of reweighted rounds: neighbours first, where a wrong bias
 * does little, then longer spans, Cauchy weights, Tukey's at the end, each scaled by the pair's
 * median residual. A round is Levenberg-Marquardt at fixed weights; between rounds the raw gyro is
 * integrated anew where the bias has moved. Where the residuals at the end are larger than
 * `sigma_px` explains, the six points at restart_rps from the seed along the axes are tried too,
 * and the solution of least residuals kept. Where the images of the window do not move (at rest),
 * the direction of translation is not defined, and rotationOnlyCost() replaces the eigenvalue.
 *
 * @param keyframes N >= 2, increasing in time; observations in increasing order of id
 * @param preintegrations N-1, between neighbours
 */
NormalEpipolarBias estimateGyroBias(const StereoInertialCalibration& calibration,
                                    const std::vector<const TrackedFrame*>& keyframes,
                                    const std::vector<Preintegration>& preintegrations,
                                    const Eigen::Vector3d& seed,
                                    const NormalEpipolarBiasOptions& options);

}  // namespace etalon
