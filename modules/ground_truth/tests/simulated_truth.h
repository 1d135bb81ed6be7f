#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon::ground_truth {

/** What is wrong with a simulated ground truth. */
struct Faults {
  double position_shift_s = -0.012, rotation_shift_s = -0.004;
  Eigen::Vector3d turn{0.004, -0.006, 0.012};            ///< rad
  Eigen::Vector3d lever{0.01, -0.02, 0.015};             ///< m
  Eigen::Vector2d tilt{0.008, -0.004};                   ///< rad, of G about x and y of W
  double position_white = 1e-3, position_smooth = 2e-3;  ///< m
  double rotation_white = 1e-3, rotation_smooth = 2e-3;  ///< rad
  double smooth_time_s = 0.7;
  TimeNs gap_from = 0, gap_to = 0;  ///< no rows between
};

struct SimulatedTruth {
  GroundTruth recorded;
  std::vector<ImuSample> imu;
  ProfileTrajectory flight;
  Eigen::Matrix3d R_GW;
};

/** A Matern 3/2 process, made by two filters of first order: not by the model's own transition. */
class SmoothNoise {
 public:
  SmoothNoise(double sigma, double time_s, double dt, std::mt19937_64* random)
      : sigma_(sigma), phi_(std::exp(-dt / time_s)), random_(random) {
    for (int i = 0; i < 5000; ++i) next();
  }
  double next() {
    // Two equal poles: the variance of the second's output is (1 + phi^2) / (1 - phi^2)^3.
    const double p2 = phi_ * phi_;
    first_ = phi_ * first_ + normal_(*random_);
    second_ = phi_ * second_ + first_;
    return sigma_ * second_ / std::sqrt((1.0 + p2) / std::pow(1.0 - p2, 3.0));
  }

 private:
  double sigma_, phi_, first_ = 0.0, second_ = 0.0;
  std::mt19937_64* random_;
  std::normal_distribution<double> normal_;
};

inline SimulatedTruth simulatedTruth(const Faults& faults, std::uint64_t seed,
                                     double duration_s = 30.0) {
  ProfileOptions profile;
  profile.profile = MotionProfile::kAggressive;
  profile.seed = seed;
  profile.duration_s = duration_s;
  SimulatedTruth truth{{}, {}, ProfileTrajectory(profile), Eigen::Matrix3d::Identity()};
  ImuSynthesisOptions imu;
  imu.rate_hz = 100.0;
  imu.seed = seed;
  imu.initial_bias = randomImuBias(seed);
  imu.noise.accel_noise_density *= 5.0;
  truth.imu = synthesizeImu(truth.flight, truth.flight.start(), truth.flight.end(), imu).samples;

  const double dt = 0.05;
  std::mt19937_64 random(seed + 1000);
  std::normal_distribution<double> normal;
  std::vector<SmoothNoise> smooth;
  for (int i = 0; i < 6; ++i)
    smooth.emplace_back(i < 3 ? faults.position_smooth : faults.rotation_smooth,
                        faults.smooth_time_s, dt, &random);
  truth.R_GW = expSO3(Eigen::Vector3d(faults.tilt.x(), faults.tilt.y(), 0.0));
  const int rows = static_cast<int>((duration_s - 1.0) / dt);
  for (int k = 0; k < rows; ++k) {
    const TimeNs t = truth.flight.start() + durationNs(0.5 + k * dt);
    Eigen::Vector3d e_p, e_r;
    for (int i = 0; i < 3; ++i) {
      e_p[i] = faults.position_white * normal(random) + smooth[static_cast<size_t>(i)].next();
      e_r[i] = faults.rotation_white * normal(random) + smooth[static_cast<size_t>(i + 3)].next();
    }
    if (faults.gap_from < t && t < faults.gap_to) continue;
    const SE3 T_p = truth.flight.at(t + durationNs(faults.position_shift_s)).T_WB;
    const SE3 T_r = truth.flight.at(t + durationNs(faults.rotation_shift_s)).T_WB;
    StampedState row;
    row.t = t;
    row.T_WB.t = truth.R_GW * (T_p * faults.lever) + e_p;
    row.T_WB.R = truth.R_GW * T_r.R * expSO3(faults.turn) * expSO3(e_r);
    truth.recorded.states.push_back(row);
  }
  return truth;
}

}  // namespace etalon::ground_truth
