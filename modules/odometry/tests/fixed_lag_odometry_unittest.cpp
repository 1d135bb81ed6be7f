// The fixed-lag odometry over whole simulated flights: consistent, and unharmed by faults.

#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "etalon/core/errors.h"
#include "etalon/core/symmetric.h"
#include "simulated_flight.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using Vector5d = Eigen::Matrix<double, 5, 1>;

FixedLagOptions optionsFor(const SimulatedFlight& flight) {
  FixedLagOptions options;
  options.imu_noise = flight.imu_noise;
  options.sigma_px = SimulatedFlightOptions().sigma_px;
  return options;
}

/** All frames of the flight; those that `keep` drops are never seen. */
std::vector<OdometryOutput> fly(const SimulatedFlight& flight,
                                const std::function<bool(size_t)>& keep = nullptr,
                                const std::optional<FixedLagOptions>& options = {}) {
  FixedLagOdometry odometry(flight.calibration, options.value_or(optionsFor(flight)));
  std::vector<OdometryOutput> outputs;
  size_t last = 0;
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    if (keep && !keep(i)) continue;
    outputs.push_back(i == 0 ? odometry.start(flight.startAt(0, startSigma(), 7), flight.frames[0])
                             : odometry.process(flight.frames[i], flight.between(last, i)));
    last = i;
  }
  return outputs;
}

/** Error of the position at the end, m, less the error at frame `from` turned along with the yaw:
 * what the way between the two added. */
double addedError(const std::vector<OdometryOutput>& outputs, const SimulatedFlight& flight,
                  size_t from) {
  const auto at = [&](size_t frame) {
    for (const OdometryOutput& out : outputs)
      if (out.t >= flight.frames[frame].t) return out.state.T_WB;
    return outputs.back().state.T_WB;
  };
  const SE3 estimate = at(from).inverse() * at(flight.frames.size() - 1);
  const SE3 truth = flight.truth[from].T_WB.inverse() * flight.truth.back().T_WB;
  return (estimate.t - truth.t).norm();
}

SimulatedFlight flight12s(std::uint64_t seed) {
  SimulatedFlightOptions options;
  options.duration_s = 12.0;
  options.tracks = 100;
  options.seed = seed;
  return simulateFlight(options);
}

/** Frames t0 to t1 (s after the first) see nothing; afterwards the tracks have new ids, or the same. */
void coverLenses(double t0, double t1, SimulatedFlight* flight, bool new_ids = true) {
  for (TrackedFrame& frame : flight->frames) {
    const double t = secondsBetween(flight->frames[0].t, frame.t);
    if (t < t0) continue;
    if (t < t1)
      frame.observations.clear();
    else if (new_ids)
      for (Observation& o : frame.observations) o.id += 100'000;
  }
}

TEST(FixedLagOdometry, IsConsistentOverAMinute) {
  // Six flights. Velocity and biases are new every few seconds, and their mean NEES is known to a
  // tenth. Errors of yaw and position stay for the whole flight: six flights are eighteen numbers,
  // whose mean square is known to a third (odometry_consistency flies more).
  Vector5d early = Vector5d::Zero(), late = Vector5d::Zero();
  int early_count = 0, late_count = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SimulatedFlightOptions options;
    options.seed = seed;
    options.frame_rate_hz = 10.0;
    options.tracks = 60;
    const SimulatedFlight flight = simulateFlight(options);
    const auto outputs = fly(flight);
    for (size_t i = 100; i < outputs.size(); ++i) {
      (i < 350 ? early : late) += neesOf(outputs[i], flight.truth[i]);
      ++(i < 350 ? early_count : late_count);
    }
  }
  const Vector5d all = (early + late) / (early_count + late_count);
  RecordProperty("nees", (std::ostringstream() << all.transpose()).str());
  for (int b = 0; b < 5; ++b) {
    EXPECT_GT(all[b], b < 2 ? 0.5 : 0.8) << b << ": " << all.transpose();
    EXPECT_LT(all[b], b < 2 ? 1.7 : 1.25) << b << ": " << all.transpose();
    // No growth with time.
    EXPECT_LT(late[b] / late_count, (b < 2 ? 2.0 : 1.5) * early[b] / early_count) << b;
  }
}

TEST(FixedLagOdometry, RepeatsItselfToTheBit) {
  const SimulatedFlight flight = flight12s(1);
  const auto one = fly(flight), two = fly(flight);
  for (size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].state.T_WB.matrix(), two[i].state.T_WB.matrix()) << i;
    ASSERT_EQ(one[i].covariance, two[i].covariance) << i;
  }
}

TEST(FixedLagOdometry, CoveredLensesAreDeadReckoning) {
  // Bars of the design: a second without images adds 3 cm at most, two 8 cm.
  for (const double gap : {0.5, 1.0, 2.0, 3.0}) {
    SimulatedFlight flight = flight12s(2);
    const double without = addedError(fly(flight), flight, 100);
    coverLenses(5.0, 5.0 + gap, &flight);
    const auto outputs = fly(flight);
    const double bar = gap <= 1.0 ? 0.03 : gap <= 2.0 ? 0.08 : 0.2;
    EXPECT_LT(addedError(outputs, flight, 100), without + bar) << gap;
    double unlocated = 0.0;
    for (size_t i = 0; i < outputs.size(); ++i) {
      unlocated = std::max(unlocated, outputs[i].unlocated_s);
      // The covariance tells: never beyond five sigma, at any instant (chi-square, 3 dof).
      EXPECT_LT(neesOf(outputs[i], flight.truth[i])[1], 8.0) << gap << " s, frame " << i;
    }
    EXPECT_NEAR(unlocated, gap, 0.06) << gap;
    EXPECT_EQ(outputs.back().unlocated_s, 0.0);
    const auto sigma = [&](size_t i) {
      return std::sqrt(outputs[i].covariance.block<3, 3>(3, 3).trace());
    };
    const auto end = static_cast<size_t>(20.0 * (5.0 + gap)) - 1;
    EXPECT_GT(sigma(end), sigma(99) + 0.002 * gap);
  }
}

TEST(FixedLagOdometry, WhatWasSeenBeforeTheLensesWereCoveredTiesWhatFollows) {
  SimulatedFlight flight = flight12s(2);
  FixedLagOptions options = optionsFor(flight);
  options.keyframe_survival = 0.3;  // the last keyframe is old, as it is in slow motion
  options.keyframe_parallax_px = 1e4;
  coverLenses(5.0, 6.0, &flight);
  const auto outputs = fly(flight, nullptr, options);
  // The position's variance grows by the velocity's error, not by the IMU's noise since the last
  // keyframe.
  const auto variance = [&outputs](size_t i, Eigen::Index of) {
    return outputs[i].covariance.block<3, 3>(of, of).trace();
  };
  const size_t seen = 99, later = 105;
  const double t = secondsBetween(flight.frames[seen].t, flight.frames[later].t);
  EXPECT_LT(std::sqrt(variance(later, 3)),
            std::sqrt(variance(seen, 3)) + 2.0 * t * std::sqrt(variance(seen, 6)));
}

TEST(FixedLagOdometry, WhatIsSeenAgainAfterTheLensesWereCoveredIsNotGated) {
  size_t gated = 0, used = 0;
  for (const double gap : {0.5, 1.0, 1.5}) {
    SimulatedFlight flight = flight12s(2);
    coverLenses(5.0, 5.0 + gap, &flight, false);
    for (const OdometryOutput& out : fly(flight)) {
      const double after = secondsBetween(flight.frames[0].t, out.t) - 5.0 - gap;
      if (after < 0.0 || after > 0.25) continue;
      gated += out.gated;
      used += out.used;
    }
  }
  EXPECT_GT(used, 1000U);
  EXPECT_LT(gated, 5U);
}

TEST(FixedLagOdometry, DroppedFramesAddLittle) {
  SimulatedFlight flight = flight12s(3);
  const double all = addedError(fly(flight), flight, 0);
  std::mt19937_64 generator(1);
  std::vector<char> lost;
  for (size_t i = 0; i < flight.frames.size(); ++i)
    lost.push_back(i > 0 && i + 1 < flight.frames.size() && generator() % 10 < 3);
  const auto outputs = fly(flight, [&](size_t i) { return !lost[i]; });
  // A fifth of the error of a run of this length (docs: about 1 cm), and a millimetre or two.
  EXPECT_LT(addedError(outputs, flight, 0), 1.2 * all + 0.004);
}

TEST(FixedLagOdometry, FliesOnWithTheLeftCameraAlone) {
  SimulatedFlight flight = flight12s(4);
  const double stereo = addedError(fly(flight), flight, 0);
  for (size_t i = 80; i < 160; ++i)
    for (Observation& o : flight.frames[i].observations) o.has_right = false;
  const auto outputs = fly(flight);
  EXPECT_LT(addedError(outputs, flight, 0), 1.2 * stereo + 0.01);
  for (const OdometryOutput& out : outputs) EXPECT_EQ(out.unlocated_s, 0.0);
}

TEST(FixedLagOdometry, FliesOnWithTheRightCameraAlone) {
  SimulatedFlight flight = flight12s(4);
  const double stereo = addedError(fly(flight), flight, 0);
  for (size_t i = 80; i < 160; ++i) {
    TrackedFrame& frame = flight.frames[i];
    for (const Observation& o : frame.observations)
      if (o.has_right) frame.right_only.push_back({o.id, o.right});
    frame.observations.clear();
  }
  const auto outputs = fly(flight);
  EXPECT_LT(addedError(outputs, flight, 0), 1.2 * stereo + 0.01);
  for (const OdometryOutput& out : outputs) EXPECT_EQ(out.unlocated_s, 0.0);
}

TEST(FixedLagOdometry, AGapInTheImuIsBridged) {
  SimulatedFlight flight = flight12s(5);
  const double whole = addedError(fly(flight), flight, 0);
  FixedLagOdometry odometry(flight.calibration, optionsFor(flight));
  std::vector<OdometryOutput> outputs;
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    const bool gap = i > 100 && i <= 110;  // half a second
    outputs.push_back(i == 0 ? odometry.start(flight.startAt(0, startSigma(), 7), flight.frames[0])
                             : odometry.process(flight.frames[i], gap ? std::vector<ImuSample>()
                                                                      : flight.between(i - 1, i)));
    EXPECT_EQ(outputs.back().imu_missing, gap);
  }
  EXPECT_LT(addedError(outputs, flight, 0), 1.2 * whole + 0.01);
}

TEST(FixedLagOdometry, WrongTracksDoNoHarm) {
  SimulatedFlightOptions options;
  options.duration_s = 12.0;
  options.tracks = 100;
  options.seed = 6;
  const double clean = addedError(fly(simulateFlight(options)), simulateFlight(options), 0);
  options.outlier_ratio = 0.05;
  const SimulatedFlight flight = simulateFlight(options);
  EXPECT_LT(addedError(fly(flight), flight, 0), 1.5 * clean + 0.01);
}

TEST(FixedLagOdometry, StandsStillAtRest) {
  SimulatedFlightOptions options;
  options.profile = MotionProfile::kStatic;
  options.duration_s = 60.0;
  options.frame_rate_hz = 10.0;
  options.tracks = 80;
  const SimulatedFlight flight = simulateFlight(options);
  const auto outputs = fly(flight);
  // Once the rest is recognised the position is that of noise: it stays within 3 mm (in ten minutes
  // within 4.5), and its mean over ten seconds goes nowhere.
  const auto mean = [&outputs](size_t from, size_t to) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = from; i < to; ++i) sum += outputs[i].state.T_WB.t;
    return Eigen::Vector3d(sum / static_cast<double>(to - from));
  };
  const Eigen::Vector3d early = mean(50, 150);
  EXPECT_LT((mean(500, 600) - early).norm(), 0.001);
  for (size_t i = 50; i < outputs.size(); ++i)
    EXPECT_LT((outputs[i].state.T_WB.t - early).norm(), 0.003) << i;
  EXPECT_LT(outputs.back().state.v_WB.norm(), 1e-3);
  // The biases are known as well as they are said to be: three of three, 99.9 % below 16.3.
  const Eigen::Vector3d b_g = outputs.back().state.bias.gyro - flight.truth.back().bias.gyro;
  EXPECT_LT(squaredMahalanobis(b_g, outputs.back().covariance.block<3, 3>(9, 9)), 16.3);
  int keyframes = 0;
  for (const OdometryOutput& out : outputs) keyframes += out.keyframe;
  EXPECT_LE(keyframes, 3);
}

TEST(FixedLagOdometry, RefusesFramesOutOfOrder) {
  const SimulatedFlight flight = flight12s(1);
  FixedLagOdometry odometry(flight.calibration, optionsFor(flight));
  odometry.start(flight.startAt(1, startSigma(), 7), flight.frames[1]);
  EXPECT_THROW(odometry.process(flight.frames[0], {}), DataError);
  OdometryStart flat = flight.startAt(0, startSigma(), 7);
  flat.covariance.setZero();
  EXPECT_THROW(odometry.start(flat, flight.frames[0]), DataError);
}

}  // namespace
}  // namespace etalon
