#pragma once

/*
 * Time offset of rotations: by how much the images are later, in the IMU's time, than their stamps,
 * so that the gyro turns from keyframe to keyframe as stereo odometry does.
 *
 * Frames      V the frame of the poses, B_k the body at keyframe k.
 * Unknown     t_d, s; b_g, rad/s; d, the error of the cameras' rotation in the body, rad.
 * Residual    per pair of neighbours, 3 x 1, rad: r_k = Log((Exp(-d) dR_k Exp(d))^T R_VBk^T R_VBk+1),
 *             dR_k integrated from t_k + t_d to t_k+1 + t_d at b_g. Right derivatives of dR_k: by
 *             t_d, w(t_k+1 + t_d) - dR_k^T w(t_k + t_d), w being the rate; by b_g, dR_dbg; by d,
 *             I - dR_k^T.
 * Whitening   by stereo odometry's covariance and the gyro's noise.
 * Prior       b_g: the problem's; d: 0.5 deg an axis; t_d: none.
 * Reference   Kelly and Sukhatme, A general framework for temporal calibration of multiple
 *             proprioceptive and exteroceptive sensors, ISER 2010: rotations alone tell the offset.
 */

#include <string>

#include "etalon/initialization/initialization_problem.h"

namespace etalon {

/** The offset, and what of it is to be believed. */
struct RotationTimeOffset {
  double offset_s = 0.0;  ///< by which the images are later, in the IMU's time, than their stamps
  double sigma_s = 0.0;  ///< standard deviation, widened by the root of chi2_per_dof if that is > 1
  double chi2_per_dof = 0.0;  ///< of the rotations, with the offset
  int pairs = 0;  ///< of neighbouring keyframes, those whose shifted interval the IMU covers

  /** More than six standard deviations and 2 ms, less than which no start is refused for; and the
   * rotations agree with it (chi2_per_dof < 10), so that it is no minimum beside the right one. */
  bool certain() const;
  /** E.g. "the stamps of the images are 10.1 ms (+- 0.2) too late". */
  std::string inWords() const;
};

/**
 * Gauss-Newton from the stamps as they are.
 * @return refused (too_few_keyframes) where the IMU covers fewer than five pairs, (not_converged),
 *         (implausible) beyond 0.1 s, (ill_conditioned) where the motion does not tell the offset
 */
Expected<RotationTimeOffset> timeOffsetOfRotations(const InitializationProblem& problem,
                                                   const VisualSolution& visual);

}  // namespace etalon
