#pragma once

// Flights at constant speed, which excite the IMU as little as can be, and what stereo odometry
// alone makes of a flight. For the tests and benchmarks of odometry.

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>

#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/odometry/stereo_odometry.h"
#include "simulated_flight.h"

namespace etalon {

/** Constant speed forward, level, and constant rate of turn about the vertical: a straight line or a
 * circle. */
class SteadyTrajectory : public SimulatedTrajectory {
 public:
  SteadyTrajectory(double speed_mps, double turn_rps, double duration_s)
      : speed_(speed_mps), turn_(turn_rps) {
    start_ = 1'400'000'000'000'000'000;
    end_ = start_ + durationNs(duration_s);
  }

  TrajectoryState at(TimeNs t) const override {
    const double s = secondsBetween(start_, std::clamp(t, start_, end_)), yaw = turn_ * s;
    const Eigen::Vector3d forward(std::cos(yaw), std::sin(yaw), 0.0);
    const Eigen::Vector3d left(-std::sin(yaw), std::cos(yaw), 0.0);
    TrajectoryState state;
    state.t = t;
    state.T_WB.t = turn_ == 0.0
                       ? Eigen::Vector3d(speed_ * s, 0.0, 0.0)
                       : Eigen::Vector3d(speed_ / turn_ * (Eigen::Vector3d::UnitY() - left));
    state.v_WB = speed_ * forward;
    state.a_W = speed_ * turn_ * left;
    state.T_WB.R << Eigen::Vector3d::UnitZ(), -left, forward;  // EuRoC's body: x up, z forward
    state.omega_B = Eigen::Vector3d(turn_, 0.0, 0.0);
    return state;
  }

 private:
  double speed_, turn_;
};

/** T_WB of every frame by stereo odometry, from the first frame's true pose. The gyro, less its true
 * bias, is for the prediction alone. @param keyframes one a frame */
inline Trajectory flyStereoAlone(const SimulatedFlight& flight, double sigma_px,
                                 const std::vector<bool>& keyframes) {
  StereoOdometryOptions options;
  options.sigma_px = sigma_px;
  StereoOdometry odometry(flight.calibration, options);
  Trajectory trajectory;
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    Eigen::Matrix3d R_prev_cur = Eigen::Matrix3d::Identity();
    if (i > 0)
      R_prev_cur = Preintegration(flight.between(i - 1, i), flight.truth[i].bias, flight.imu_noise)
                       .deltas()
                       .dR;
    const SE3 T_VB = odometry.track(flight.frames[i], R_prev_cur, keyframes[i]).T_VB;
    trajectory.push_back({flight.frames[i].t, flight.truth[0].T_WB * T_VB});
  }
  return trajectory;
}

/** What an odometry is off by over a flight, from its frame `first` on: before, the errors of a
 * start are being corrected, which is no drift. */
struct Drift {
  double scale = 0.0;     ///< of the similarity that aligns the positions best, less 1
  double ate = 0.0;       ///< m, RMS of the positions after alignment in rotation and position
  double rotation = 0.0;  ///< rad, of the last frame as seen from the first
};

inline Drift driftOf(const Trajectory& estimate, const SimulatedFlight& flight, size_t first) {
  const auto count = static_cast<Eigen::Index>(estimate.size() - first);
  Eigen::Matrix3Xd estimated(3, count), truth(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    estimated.col(i) = estimate[first + i].T_WB.t;
    truth.col(i) = flight.truth[first + i].T_WB.t;
  }
  Drift drift;
  const Eigen::Matrix4d similarity = Eigen::umeyama(truth, estimated, true);
  drift.scale = similarity.col(0).head<3>().norm() - 1.0;
  const Eigen::Matrix4d rigid = Eigen::umeyama(truth, estimated, false);
  const Eigen::Matrix3Xd off =
      ((rigid.topLeftCorner<3, 3>() * truth).colwise() + rigid.col(3).head<3>()) - estimated;
  drift.ate = off.norm() / std::sqrt(static_cast<double>(count));
  const auto turn = [first](const auto& poses) -> Eigen::Matrix3d {
    return poses[first].T_WB.R.transpose() * poses.back().T_WB.R;
  };
  drift.rotation = logSO3(turn(flight.truth).transpose() * turn(estimate)).norm();
  return drift;
}

/** Root mean squares over flights. */
class DriftRms {
 public:
  void add(const Drift& drift) {
    scale_ += drift.scale * drift.scale;
    ate_ += drift.ate * drift.ate;
    rotation_ += drift.rotation * drift.rotation;
    ++count_;
  }
  Drift get() const {
    return {std::sqrt(scale_ / count_), std::sqrt(ate_ / count_), std::sqrt(rotation_ / count_)};
  }

 private:
  double scale_ = 0.0, ate_ = 0.0, rotation_ = 0.0;
  int count_ = 0;
};

}  // namespace etalon
