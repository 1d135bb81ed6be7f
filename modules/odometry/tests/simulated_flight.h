#pragma once

// A flight without images: what a front end and an IMU would report of it, and the truth. For the
// tests and benchmarks of odometry.

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/symmetric.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/integrated_trajectory.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/track_synthesis.h"

namespace etalon {

/** Of a flight before its first frame: a profile takes off from rest. */
constexpr double kUnderWay = 5.0;  // s

struct SimulatedFlightOptions {
  MotionProfile profile = MotionProfile::kAggressive;
  double duration_s = 60.0;  ///< of the frames; the flight is under way at the first
  double frame_rate_hz = 20.0;
  double sigma_px = 0.35;
  double outlier_ratio = 0.0;
  double right_ratio = 1.0;
  int tracks = 120;
  bool imu_noise = true, bias_walk = true;
  double time_offset_s = 0.0;  ///< images are taken later, in the IMU's time, than their stamps
  double gyro_noise_factor = 2.0, accel_noise_factor = 6.0;  ///< times the data sheet
  std::uint64_t seed = 1;
};

struct SimulatedFlight {
  StereoInertialCalibration calibration;
  ImuNoiseDensities imu_noise;  ///< that the samples have
  ImuBuffer imu;
  std::vector<TrackedFrame> frames;
  std::vector<NavState> truth;             ///< one a frame
  std::vector<Eigen::Vector3d> landmarks;  ///< p_W by id, m

  /** The samples between two frames. */
  std::vector<ImuSample> between(size_t a, size_t b) const {
    return imu.between(frames[a].t, frames[b].t);
  }

  /** The true state with errors drawn from `sigma` (order of state_index). */
  OdometryStart startAt(size_t frame, const Eigen::Matrix<double, 15, 1>& sigma,
                        std::uint64_t seed) const {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Eigen::Matrix<double, 15, 1> error;
    for (int i = 0; i < 15; ++i) error[i] = sigma[i] * normal(generator);
    OdometryStart start;
    start.state = truth[frame].plus(error);
    start.covariance = sigma.cwiseAbs2().asDiagonal();
    return start;
  }
};

/** Errors of a good initialization, order of state_index. */
inline Eigen::Matrix<double, 15, 1> startSigma() {
  Eigen::Matrix<double, 15, 1> sigma;
  sigma << Eigen::Vector3d::Constant(0.005), Eigen::Vector3d::Constant(1e-3),
      Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.002),
      Eigen::Vector3d::Constant(0.03);
  return sigma;
}

/**
 * A flight along `smooth`, whose first kUnderWay seconds have no frames; the profile and duration
 * of the options are of no effect.
 */
inline SimulatedFlight simulateFlight(const SimulatedFlightOptions& options,
                                      const SimulatedTrajectory& smooth) {
  constexpr double kImuRate = 200.0;  // Hz
  const IntegratedTrajectory trajectory(smooth, kImuRate);

  SimulatedFlight flight;
  flight.calibration = eurocCalibration();
  flight.imu_noise = flight.calibration.imu.noise;
  flight.imu_noise.gyro_noise_density *= options.gyro_noise_factor;
  flight.imu_noise.accel_noise_density *= options.accel_noise_factor;
  ImuSynthesisOptions imu;
  imu.rate_hz = kImuRate;
  imu.noise = flight.imu_noise;
  imu.white_noise = options.imu_noise;
  imu.bias_walk = options.bias_walk;
  imu.initial_bias = randomImuBias(options.seed);
  imu.seed = options.seed;
  const SyntheticImu samples = synthesizeImu(trajectory, trajectory.start(), trajectory.end(), imu);
  flight.imu = ImuBuffer(samples.samples);

  Trajectory poses;
  const auto late = static_cast<TimeNs>(std::llround(1e9 * options.time_offset_s));
  const TimeNs first = stampAtRate(trajectory.start(), kImuRate, llround(kUnderWay * kImuRate));
  for (int k = 0; stampAtRate(first, options.frame_rate_hz, k) <= trajectory.end(); ++k) {
    const TimeNs taken = stampAtRate(first, options.frame_rate_hz, k);
    const TrajectoryState state = trajectory.at(taken - late);
    const size_t index = std::llround(secondsBetween(trajectory.start(), state.t) * kImuRate);
    poses.push_back({taken, trajectory.at(taken).T_WB});
    flight.truth.push_back({state.T_WB, state.v_WB, samples.biases[index]});
  }
  TrackSynthesisOptions tracks;
  tracks.sigma_px = options.sigma_px;
  tracks.outlier_ratio = options.outlier_ratio;
  tracks.right_ratio = options.right_ratio;
  tracks.max_tracks = options.tracks;
  tracks.seed = options.seed;
  flight.landmarks = scatterLandmarks(trajectory, 1500, options.seed);
  flight.frames = simulateTracks(poses, flight.calibration, flight.landmarks, tracks);
  for (TrackedFrame& frame : flight.frames) frame.t -= late;
  return flight;
}

inline SimulatedFlight simulateFlight(const SimulatedFlightOptions& options) {
  ProfileOptions profile;
  profile.profile = options.profile;
  profile.seed = options.seed;
  profile.rest_s = 0.5;
  profile.duration_s = kUnderWay + options.duration_s;
  return simulateFlight(options, ProfileTrajectory(profile));
}

/** Squared error over the covariance that is claimed, a degree of freedom; five of three rows, in
 * the order of state_index. */
inline Eigen::Matrix<double, 5, 1> neesOf(const OdometryOutput& out, const NavState& truth) {
  const Eigen::Matrix<double, 15, 1> d = out.state.minus(truth);
  Eigen::Matrix<double, 5, 1> nees;
  for (int b = 0; b < 5; ++b) {
    const Eigen::Matrix3d P = out.covariance.block<3, 3>(3 * b, 3 * b);
    nees[b] = squaredMahalanobis(d.segment<3>(3 * b), P) / 3.0;
  }
  return nees;
}

}  // namespace etalon
