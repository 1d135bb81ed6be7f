#pragma once

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon::ground_truth {

/** A tracker whose poses somebody smoothed with the recording's IMU, as EuRoC's were. */
struct SmoothedTracker {
  double position_shift_s = 0.0, rotation_shift_s = 0.0;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< rad
  double position_white = 1e-3, rotation_white = 1e-3;
  double position_hz = 0.8, rotation_hz = 0.0;  ///< bandwidths of the smoother; 0: not smoothed
};

/**
 * Kalman filter and Rauch-Tung-Striebel smoother of a chain of steps alike, three axes at once.
 * @param measured a column a step, of the state's first row
 * @param inputs added to the state in a step; one fewer than columns of `measured`
 * @return the first row of the smoothed states
 */
template <int kState>
Eigen::Matrix3Xd smoothedAxes(const Eigen::Matrix3Xd& measured,
                              const std::vector<Eigen::Matrix<double, kState, 3>>& inputs,
                              const Eigen::Matrix<double, kState, kState>& F,
                              const Eigen::Matrix<double, kState, kState>& Q, double sigma) {
  using State = Eigen::Matrix<double, kState, 3>;
  using Covariance = Eigen::Matrix<double, kState, kState>;
  const Eigen::Index n = measured.cols();
  std::vector<State> x(static_cast<size_t>(n)), predicted = x;
  std::vector<Covariance> P(x.size()), P_predicted = P;
  for (size_t k = 0; k < x.size(); ++k) {
    predicted[k] = k == 0 ? State(State::Zero()) : State(F * x[k - 1] + inputs[k - 1]);
    P_predicted[k] = k == 0 ? Covariance(1e4 * Covariance::Identity())
                            : Covariance(F * P[k - 1] * F.transpose() + Q);
    const Eigen::Matrix<double, kState, 1> gain =
        P_predicted[k].col(0) / (P_predicted[k](0, 0) + sigma * sigma);
    x[k] = predicted[k] +
           gain * (measured.col(static_cast<Eigen::Index>(k)).transpose() - predicted[k].row(0));
    P[k] = P_predicted[k] - gain * P_predicted[k].row(0);
  }
  for (size_t k = x.size() - 1; k-- > 0;)
    x[k] += P[k] * F.transpose() * P_predicted[k + 1].inverse() * (x[k + 1] - predicted[k + 1]);
  Eigen::Matrix3Xd result(3, n);
  for (size_t k = 0; k < x.size(); ++k)
    result.col(static_cast<Eigen::Index>(k)) = x[k].row(0).transpose();
  return result;
}

/** Positions that follow `tracked` below `hz` and the IMU above: MAP of white positions of variance
 * s^2 dt^-1 and white accelerations, whose response is 1 / (1 + (f / hz)^4). */
inline Eigen::Matrix3Xd smoothedPositions(const Eigen::Matrix3Xd& tracked,
                                          const std::vector<StampedState>& bodies,
                                          const ImuBuffer& imu, const ImuBias& bias, double hz) {
  const double dt = secondsBetween(bodies[0].t, bodies[1].t);
  const Eigen::Vector3d g(0.0, 0.0, -9.81);
  std::vector<Eigen::Matrix<double, 2, 3>> inputs;
  for (size_t k = 0; k + 1 < bodies.size(); ++k) {
    const Preintegration motion(imu.between(bodies[k].t, bodies[k + 1].t), bias, {});
    const Eigen::Matrix3d& R = bodies[k].T_WB.R;
    inputs.emplace_back();
    inputs.back() << (R * motion.deltas().dp + 0.5 * dt * dt * g).transpose(),
        (R * motion.deltas().dv + dt * g).transpose();
  }
  // Acceleration's spectrum over the positions': (2 pi hz)^4; the positions' is sigma^2 dt, of one.
  const double q = std::pow(2.0 * M_PI * hz, 4.0) * dt;
  Eigen::Matrix2d F, Q;
  F << 1.0, dt, 0.0, 1.0;
  Q << dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt;
  return smoothedAxes<2>(tracked, inputs, F, q * Q, 1.0);
}

/** The same of small rotations against those of a perfect gyro: 1 / (1 + (f / hz)^2). */
inline Eigen::Matrix3Xd smoothedRotations(const Eigen::Matrix3Xd& offsets, double dt, double hz) {
  const double q = std::pow(2.0 * M_PI * hz, 2.0) * dt * dt;
  using One = Eigen::Matrix<double, 1, 1>;
  const std::vector<Eigen::Matrix<double, 1, 3>> still(static_cast<size_t>(offsets.cols() - 1),
                                                       Eigen::Matrix<double, 1, 3>::Zero());
  return smoothedAxes<1>(offsets, still, One::Identity(), q * One::Identity(), 1.0);
}

struct SmoothedTruth {
  GroundTruth recorded;
  std::vector<ImuSample> imu;
};

inline SmoothedTruth smoothedTruth(const SmoothedTracker& tracker, std::uint64_t seed,
                                   double duration_s) {
  ProfileOptions profile;
  profile.profile = MotionProfile::kAggressive;
  profile.seed = seed;
  profile.duration_s = duration_s;
  const ProfileTrajectory flight(profile);
  ImuSynthesisOptions options;
  options.rate_hz = 100.0;
  options.seed = seed;
  options.initial_bias = randomImuBias(seed);
  options.bias_walk = false;  // the smoother below knows the biases
  SmoothedTruth truth;
  truth.imu = synthesizeImu(flight, flight.start(), flight.end(), options).samples;

  const double dt = 0.05;
  const auto rows = static_cast<Eigen::Index>((duration_s - 1.0) / dt);
  std::mt19937_64 random(seed + 2000);
  std::normal_distribution<double> normal;
  Eigen::Matrix3Xd positions(3, rows), rotations(3, rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const TimeNs t = flight.start() + durationNs(0.5 + static_cast<double>(k) * dt);
    const SE3 T_WB = flight.at(t).T_WB;
    const SE3 T_p = flight.at(t + durationNs(tracker.position_shift_s)).T_WB;
    const SE3 T_r = flight.at(t + durationNs(tracker.rotation_shift_s)).T_WB;
    truth.recorded.states.emplace_back(t, T_WB);
    positions.col(k) = T_p.t;
    rotations.col(k) = logSO3(T_r.R * expSO3(tracker.turn) * T_WB.R.transpose());
    for (int i = 0; i < 3; ++i) {
      positions(i, k) += tracker.position_white * normal(random);
      rotations(i, k) += tracker.rotation_white * normal(random);
    }
  }
  std::vector<StampedState>& states = truth.recorded.states;
  if (tracker.position_hz > 0.0)
    positions = smoothedPositions(positions, states, ImuBuffer(truth.imu), options.initial_bias,
                                  tracker.position_hz);
  if (tracker.rotation_hz > 0.0) rotations = smoothedRotations(rotations, dt, tracker.rotation_hz);
  for (Eigen::Index k = 0; k < rows; ++k) {
    SE3& row = states[static_cast<size_t>(k)].T_WB;
    row.t = positions.col(k);
    row.R = expSO3(rotations.col(k)) * row.R;
  }
  return truth;
}

}  // namespace etalon::ground_truth
