#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/refusal.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/** A number and its standard error. */
struct Measured {
  double value = 0.0;
  double sigma = 0.0;
};

/** Three numbers of one kind and their standard errors. */
struct Measured3 {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
};

/**
 * The error of a measured position or rotation, an axis: white from one believed row to the next, and
 * on top of it a smooth one of correlation (1 + t / time) exp(-t / time) (Matern 3/2).
 */
struct ErrorModel {
  Measured white;       ///< m or rad
  Measured correlated;  ///< m or rad
  Measured correlation_time_s;
};

/** How much worse the IMU is than its data sheet, as factors of the densities. */
struct ImuFactors {
  Measured gyro_noise, gyro_walk, accel_noise, accel_walk;
};

/** Rows that are further apart than the others; those within a gap of the IMU are not used. */
struct GroundTruthGap {
  TimeNs after = 0;       ///< stamp of the last row before it
  double length_s = 0.0;  ///< to the first row after it
};

struct GroundTruthSmoothingOptions {
  double step_s = 0.1;  ///< from a state of the smoothing to the next
  /** Rows that are believed are so far apart, s. Those between repeat the recording's own IMU where
   * its ground truth was smoothed with it, and would be counted as if they knew something new. */
  double row_step_s = 0.5;
  double max_bridged_gap_s = 1.0;  ///< longer gaps of the ground truth stay gaps
  double block_s = 12.0;           ///< of the jackknife; there are 5 blocks at least
};

/** Shift, turn and lever arm of the recorded body. */
struct BodyOffset {
  Measured position_shift_s, rotation_shift_s;
  Measured common_shift_s;          ///< one for both, as their covariance weights them
  double shifts_differ_sigmas = 0;  ///< by how many standard errors of the difference they differ
  Measured3 turn_rad;               ///< rotation vector of R_BM
  Measured3 lever_m;                ///< origin of M in B
};

/**
 * What a recorded ground truth has wrong, and the same without it. G is the recorded world, M the
 * body whose pose a tracker saw, B the IMU's. A row stamped t shows
 *   p_GM = p_GB + L_p[p_GB(t + shift_p) + R_GB(t + shift_p) lever - p_GB] + error,
 *   R_GM = Exp(L_r[Log(R_GB(t + shift_r) Exp(turn) R_GB^T)]) R_GB Exp(error):
 * a negative shift is a row that shows the past, that is, one that comes late. L are low passes. Who
 * smoothed a tracker's poses with the IMU followed the tracker below the bandwidth and the IMU above
 * it; there the recorded poses have none of the tracker's offsets.
 */
struct GroundTruthSmoothing {
  BodyOffset offset;  ///< of the tracker, which is that of slow motion
  /** The same from a fit without low passes, as if the rows had it at all frequencies. Where they
   * have not, it depends on how fast the motion is that the fit looks at. */
  BodyOffset plain_offset;
  /** Of the low passes; infinite where the rows are as likely without one. */
  Measured position_bandwidth_hz, rotation_bandwidth_hz;

  /** Gravity's direction in G: its x and y against -z, rad. */
  Measured gravity_x_rad, gravity_y_rad;
  Measured tilt_rad;  ///< angle between the two
  double gravity_mps2 = 0.0;
  ErrorModel position_error;  ///< in G, m
  ErrorModel rotation_error;  ///< in M, rad
  ImuFactors imu;

  size_t rows = 0;      ///< of the recorded ground truth
  size_t believed = 0;  ///< those of them that the fit believes
  double length_s = 0.0;
  std::vector<GroundTruthGap> gaps;
  int blocks = 0;  ///< left out one after the other for the standard errors

  /** In a world W with z up along gravity and G's yaw and origin, the IMU as body, at the stamps of
   * the IMU, with velocities and biases. */
  GroundTruth corrected;
};

/**
 * Maximum a posteriori of a whole recording: pose, velocity and biases of the body every `step_s`,
 * correlated errors of position and rotation beside them, and what all share: shifts, turn, lever
 * arm and gravity. The sizes of all errors, the IMU's among them, and the bandwidths are those of
 * greatest marginal likelihood; a low pass there is where the rows are clearly less likely without.
 * Standard errors are the larger of what the model says (with what is
 * not known of the sizes) and of what leaving out one block of the recording after the other says
 * (delete-a-group jackknife).
 *
 * @param recorded poses; velocities and biases are not used
 * @param imu increasing in time
 * @param data_sheet densities of the IMU; its factors are estimated
 * @return refused: rows that are not finite or not in order, too few that the IMU covers, or a fit
 * that does not converge
 */
Expected<GroundTruthSmoothing> smoothGroundTruth(const GroundTruth& recorded,
                                                 const std::vector<ImuSample>& imu,
                                                 const ImuNoiseDensities& data_sheet,
                                                 const GroundTruthSmoothingOptions& options = {});

}  // namespace etalon
