#pragma once

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/initialization/joint/joint_system.h"

namespace etalon {

/** Parameters of the joint MAP as a step of an initializer. */
struct JointMapOptions {
  int frame_stride = 0;
  int max_passes = 20;
  double converged_rps = 1e-4;
  /** As JointEstimate::step_sigmas: a pass that moves the poses by more is not the last; not a key. */
  double converged_sigmas = 0.4;
  double chi2_pixel = kChi2Pixel;
  double chi2_stereo = 16.0;
  int min_landmarks = 15;
  double min_inlier_share = 0.3;
  double max_sigma_gravity_deg = 5.0;
  /** Of the pixels, the share of the problem's that is believed at least where the residuals show
   * less (TrackInformation). */
  double least_noise = 1.0;
  JointModel model;
  bool covariance = true;  ///< false: the result has none; not a key

  /** All keys but `least_noise` and the model's. */
  void declare(ParameterSet& parameters);
};

/**
 * One MAP over poses, velocities, gravity's direction, b_g and b_a of a window, from its tracks and
 * raw IMU. The landmarks are eliminated (TrackInformation); what is left is a linear system with one
 * constraint, gravity's norm (JointSystem), solved anew at the last pass's solution until b_g and the
 * poses stand still. The seed is linear: stereo points of single frames, from how they turn b_g
 * (stereo_start.h).
 *
 * The covariance is that of errors at a minimum of the cost: far landmarks, whose fitted depth makes
 * a lever of noise, count by the cost's curvature (NormalEquations). Where the model takes the IMU as
 * exact, or b_a as known, errors are those against the solution that does not (covarianceAround()),
 * from this one on; it is empty where that does not come to rest. Timings: "start", "closed_form",
 * in that case "covariance".
 *
 * @return refused: too_few_tracks, implausible, ill_conditioned, not_converged
 */
InitializationResult solveJointMap(const InitializationProblem& problem,
                                   const JointMapOptions& options);

}  // namespace etalon
