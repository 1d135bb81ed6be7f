// What is known of a flight with hindsight: the keyframes' last estimates, and the adjustment of all
// of them.

#include "etalon/odometry/flight_record.h"

#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "etalon/core/so3.h"
#include "simulated_flight.h"

namespace etalon {
namespace {

/** A flight, what the fixed-lag odometry made of it, and its record. */
struct Recorded {
  SimulatedFlight flight;
  Trajectory causal;
  std::vector<NavState> causal_states;
  FlightRecord record;

  static FlightRecordOptions recordOptions(const SimulatedFlight& flight, size_t max_keyframes) {
    FlightRecordOptions options;
    options.imu_noise = flight.imu_noise;
    options.sigma_px = SimulatedFlightOptions().sigma_px;
    options.max_keyframes = max_keyframes;
    return options;
  }

  /** Frames from the first number up to the second. */
  using Range = std::pair<size_t, size_t>;

  /** @param without_imu frames that have none @param blind frames that show no landmark */
  explicit Recorded(const SimulatedFlightOptions& options, size_t max_keyframes = 1000,
                    Range without_imu = {0, 0}, Range blind = {0, 0})
      : flight(simulateFlight(options)),
        record(flight.calibration, recordOptions(flight, max_keyframes)) {
    FixedLagOptions odometry_options;
    odometry_options.imu_noise = flight.imu_noise;
    odometry_options.sigma_px = SimulatedFlightOptions().sigma_px;
    FixedLagOdometry odometry(flight.calibration, odometry_options);
    const auto in = [](const Range& range, size_t k) {
      return range.first <= k && k < range.second;
    };
    for (size_t k = 0; k < flight.frames.size(); ++k) {
      if (in(blind, k)) flight.frames[k].observations.clear();
      std::vector<ImuSample> imu;
      if (k > 0 && !in(without_imu, k)) imu = flight.between(k - 1, k);
      const OdometryOutput out =
          k == 0 ? odometry.start(flight.startAt(0, startSigma(), options.seed), flight.frames[0])
                 : odometry.process(flight.frames[k], imu);
      causal.push_back({stampOf(k), out.state.T_WB});
      record.add(stampOf(k), flight.frames[k], imu, out, &odometry);
    }
  }

  /** The stamps of the frames are not the odometry's time. */
  TimeNs stampOf(size_t k) const { return flight.frames[k].t + 7 * kNanosecondsPerSecond; }

  /** RMS of the position after position and yaw of the first pose are the truth's, m. */
  double error(const Trajectory& trajectory) const {
    double sum = 0.0;
    for (size_t k = 0; k < trajectory.size(); ++k)
      sum += ((trajectory[k].T_WB.t - trajectory[0].T_WB.t) -
              (flight.truth[k].T_WB.t - flight.truth[0].T_WB.t))
                 .squaredNorm();
    return std::sqrt(sum / static_cast<double>(trajectory.size()));
  }

  /** Largest error of the position, relative to a frame, up to another one, m. */
  double errorBetween(const Trajectory& trajectory, size_t from, size_t to) const {
    double largest = 0.0;
    for (size_t k = from; k <= to; ++k)
      largest = std::max(largest, ((trajectory[k].T_WB.t - trajectory[from].T_WB.t) -
                                   (flight.truth[k].T_WB.t - flight.truth[from].T_WB.t))
                                      .norm());
    return largest;
  }
};

SimulatedFlightOptions tenSeconds() {
  SimulatedFlightOptions options;
  options.duration_s = 10.0;
  options.tracks = 60;
  return options;
}

TEST(FlightRecord, HindsightIsBetterThanTheMoment) {
  constexpr int kFlights = 6;
  double causal = 0.0, smoothed = 0.0, finally = 0.0;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    SimulatedFlightOptions options = tenSeconds();
    options.seed = seed;
    options.outlier_ratio = 0.02;
    const Recorded run(options);
    const Trajectory by_lag = run.record.smoothedFlight(run.causal);
    const FinalFlight flight = run.record.finalBa({});
    EXPECT_TRUE(flight.ba.summary.usable()) << flight.ba.summary.message;
    EXPECT_EQ(flight.keyframes.size(), run.record.smoothed().size());
    EXPECT_GT(run.record.landmarks().size(), 60U);
    // The noise is as believed, 0.35 px: the inliers' median lacks what is cut off above a squared
    // distance of 8 (1 %) and what states and landmarks take (5 %). The outliers are out.
    EXPECT_NEAR(flight.ba.noise_factor, 0.95, 0.05);
    EXPECT_LT(flight.ba.bundle.inlierCount(),
              0.99 * static_cast<double>(flight.ba.bundle.window.measurements.size()));
    causal += run.error(run.causal);
    smoothed += run.error(by_lag);
    finally += run.error(carriedAlong(by_lag, flight.keyframes));
  }
  // Single flights scatter; the sums of six do not cross.
  EXPECT_LT(smoothed, causal);
  EXPECT_LT(finally, smoothed);
  EXPECT_LT(finally / kFlights, 0.02);
}

TEST(FlightRecord, WhatWasFoundAgainHoldsTheFinalTrajectory) {
  // Every second all tracks are new ones; keyframes say where their landmarks were in the first.
  constexpr LandmarkId kNew = 1000000;
  double with = 0.0, without = 0.0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SimulatedFlightOptions options = tenSeconds();
    options.frame_rate_hz = 10.0;
    options.seed = seed;
    SimulatedFlight flight = simulateFlight(options);
    const std::vector<Observation> first = flight.frames[0].observations;
    for (size_t k = 0; k < flight.frames.size(); ++k)
      for (Observation& o : flight.frames[k].observations)
        o.id += static_cast<LandmarkId>(k / 10) * kNew;
    FixedLagOptions odometry_options;
    odometry_options.imu_noise = flight.imu_noise;
    FixedLagOdometry odometry(flight.calibration, odometry_options);
    const FlightRecordOptions record_options = Recorded::recordOptions(flight, 1000);
    FlightRecord record(flight.calibration, record_options);
    FlightRecord blind(flight.calibration, record_options);
    for (size_t k = 0; k < flight.frames.size(); ++k) {
      std::vector<ImuSample> imu;
      if (k > 0) imu = flight.between(k - 1, k);
      const TrackedFrame& frame = flight.frames[k];
      OdometryOutput out = k == 0 ? odometry.start(flight.startAt(0, startSigma(), seed), frame)
                                  : odometry.process(frame, imu);
      blind.add(frame.t, frame, imu, out, &odometry);
      for (const Observation& o : frame.observations)
        for (Observation old : first)
          if (k >= 10 && o.id % kNew == old.id) {
            old.id = o.id;
            out.recalled.push_back({flight.frames[0].t, old});
          }
      record.add(frame.t, frame, imu, out, &odometry);
    }
    const auto error = [&flight](const FlightRecord& of) {
      const FinalFlight result = of.finalBa({});
      EXPECT_TRUE(result.ba.summary.usable()) << result.ba.summary.message;
      return (result.keyframes.back().T_WB.t - flight.truth.back().T_WB.t).norm();
    };
    with += error(record);
    without += error(blind);
  }
  RecordProperty("errors", (std::ostringstream() << with << ' ' << without).str());
  EXPECT_LT(with, 0.7 * without);
}

TEST(FlightRecord, IsTheSameBitForBit) {
  SimulatedFlightOptions options = tenSeconds();
  options.duration_s = 4.0;
  const Recorded run(options);
  const FinalFlight a = run.record.finalBa({}), b = run.record.finalBa({});
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (size_t k = 0; k < a.keyframes.size(); ++k) {
    EXPECT_EQ(a.keyframes[k].T_WB.R, b.keyframes[k].T_WB.R);
    EXPECT_EQ(a.keyframes[k].T_WB.t, b.keyframes[k].T_WB.t);
  }
}

TEST(FlightRecord, AGapOfTheImuIsBridged) {
  SimulatedFlightOptions options = tenSeconds();
  options.duration_s = 5.0;
  const Recorded run(options, 1000, {40, 60});
  const FinalFlight flight = run.record.finalBa({});
  EXPECT_TRUE(flight.ba.summary.usable()) << flight.ba.summary.message;
  EXPECT_LT(run.error(carriedAlong(run.causal, flight.keyframes)), 0.03);
}

TEST(FlightRecord, HindsightMendsWhatTheImuAloneTold) {
  constexpr size_t kFrom = 100, kTo = 140;  // two seconds
  double causal = 0.0, smoothed = 0.0, finally = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedFlightOptions options = tenSeconds();
    options.seed = seed;
    const Recorded run(options, 1000, {0, 0}, {kFrom, kTo});
    const Trajectory by_lag = run.record.smoothedFlight(run.causal);
    // The last frame before and the first after are keyframes.
    std::set<TimeNs> keyframes;
    for (const StampedPose& pose : run.record.smoothed()) keyframes.insert(pose.t);
    EXPECT_EQ(keyframes.count(run.stampOf(kFrom - 1)), 1U);
    EXPECT_EQ(keyframes.count(run.stampOf(kFrom)), 0U);
    EXPECT_EQ(keyframes.count(run.stampOf(kTo)), 1U);
    const FinalFlight flight = run.record.finalBa({});
    EXPECT_TRUE(flight.ba.summary.usable()) << flight.ba.summary.message;
    EXPECT_EQ(flight.keyframes.size(), keyframes.size());
    causal += run.errorBetween(run.causal, kFrom - 1, kTo);
    smoothed += run.errorBetween(by_lag, kFrom - 1, kTo);
    finally += run.errorBetween(carriedAlong(by_lag, flight.keyframes), kFrom - 1, kTo);
  }
  RecordProperty("errors",
                 (std::ostringstream() << causal << ' ' << smoothed << ' ' << finally).str());
  EXPECT_LT(smoothed, 0.5 * causal);
  EXPECT_LT(finally, 0.5 * causal);
}

TEST(FlightRecord, KeepsTheNewestKeyframesAlone) {
  SimulatedFlightOptions options = tenSeconds();
  options.duration_s = 4.0;
  const Recorded run(options, 5);
  const FinalFlight flight = run.record.finalBa({});
  ASSERT_EQ(flight.keyframes.size(), 5U);
  ASSERT_GT(run.record.smoothed().size(), 5U);
  EXPECT_EQ(flight.keyframes.back().t, run.record.smoothed().back().t);
  EXPECT_TRUE(Recorded(options, 0).record.finalBa({}).keyframes.empty());
}

TEST(FlightRecord, AnAdjustmentThatIsToldToStopChangesNothing) {
  SimulatedFlightOptions options = tenSeconds();
  options.duration_s = 4.0;
  const Recorded run(options);
  int asked_last = 0;
  TrajectoryBaOptions ba;
  ba.go_on = [&asked_last](int iterations) {
    asked_last = iterations;
    return iterations < 3;
  };
  const FinalFlight flight = run.record.finalBa({}, ba);
  EXPECT_EQ(flight.ba.summary.termination, Termination::kStopped);
  EXPECT_EQ(asked_last, 3);
  EXPECT_FALSE(flight.ba.summary.usable());
  ba.go_on = [](int) { return false; };  // at once: nothing is solved
  const FinalFlight start = run.record.finalBa({}, ba);
  ASSERT_EQ(flight.keyframes.size(), start.keyframes.size());
  for (size_t k = 0; k < start.keyframes.size(); ++k)
    EXPECT_EQ(flight.keyframes[k].T_WB.t, start.keyframes[k].T_WB.t);
}

TEST(FlightRecord, AFlightInTwoPiecesIsAdjustedAsOne) {
  SimulatedFlightOptions options = tenSeconds();
  options.duration_s = 4.0;
  Recorded run(options);
  // The odometry ends, and a second later starts again where it was, with the same tracks.
  run.record.interrupt();
  OdometryOutput again;
  const size_t k = run.flight.frames.size() - 1;
  TrackedFrame frame = run.flight.frames[k];
  again.state = run.flight.truth[k];
  again.keyframe = true;
  frame.t += durationNs(1.0);
  run.record.add(run.stampOf(k) + durationNs(1.0), frame, {}, again, nullptr);
  const FinalFlight flight = run.record.finalBa({});
  ASSERT_TRUE(flight.ba.summary.usable()) << flight.ba.summary.message;
  // The tracks say where the last keyframe is, to the noise of a frame's pose.
  const Trajectory carried = carriedAlong(run.causal, flight.keyframes);
  EXPECT_LT((flight.keyframes.back().T_WB.t - carried.back().T_WB.t).norm(), 0.01);
}

}  // namespace
}  // namespace etalon
