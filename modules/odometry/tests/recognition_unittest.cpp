// A flight without images for seconds, after which old keyframes are recognised by how they look.

#include <gtest/gtest.h>

#include <optional>

#include "etalon/core/so3.h"
#include "etalon/odometry/flight_record.h"
#include "simulated_views.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr LandmarkId kNewTracks = 1'000'000;
constexpr double kPatchReachPx = 12.0;

/** Patches are aligned from nearby alone; how a view looks tells its pose to 2 cm and 0.2 deg. */
class LookingViews : public SimulatedViews {
 public:
  explicit LookingViews(const SimulatedFlight& flight)
      : SimulatedViews(flight, 0.5), flight_(&flight) {}

  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override {
    std::vector<ViewQuery> of_points = queries;
    for (ViewQuery& query : of_points) query.id %= kNewTracks;
    std::vector<ViewMatch> matches = SimulatedViews::find(view, of_points);
    for (size_t i = 0; i < matches.size(); ++i)
      matches[i].found =
          matches[i].found && (matches[i].left - queries[i].left).norm() < kPatchReachPx;
    return matches;
  }
  bool prepare(TimeNs view) override {
    if (std::find(prepared_.begin(), prepared_.end(), view) != prepared_.end()) return false;
    prepared_.push_back(view);
    return true;
  }
  std::optional<OldView> recognize(TimeNs view) override {
    if (std::find(prepared_.begin(), prepared_.end(), view) == prepared_.end()) return std::nullopt;
    const SE3 T_NV = truthAt(now_).inverse() * truthAt(view) * elsewhere_;
    OldView guess{{T_NV.R * expSO3({0.002, -0.003, 0.002}), T_NV.t + Vector3d(0.01, 0.01, -0.01)},
                  {}};
    guess.covariance.setZero();
    guess.covariance.diagonal() << Vector3d::Constant(1.6e-5), Vector3d::Constant(4e-4);
    return guess;
  }
  SE3 truthAt(TimeNs t) const {
    size_t k = 0;
    while (flight_->frames[k].t != t) ++k;
    return flight_->truth[k].T_WB;
  }

  TimeNs now_ = 0;
  SE3 elsewhere_;  ///< it takes another place for the view

 private:
  const SimulatedFlight* flight_;
  std::vector<TimeNs> prepared_;
};

/** Thirty seconds, of which six show nothing; meanwhile the accelerometer is wrong. A second such
 * while may follow. */
class AfterDarkness : public ::testing::Test {
 protected:
  static constexpr size_t kDark = 150, kLight = 210;

  AfterDarkness() {
    SimulatedFlightOptions options;
    options.duration_s = 30.0;
    options.frame_rate_hz = 10.0;
    flight_ = simulateFlight(options);
    for (size_t k = kDark; k < flight_.frames.size(); ++k) {
      auto& seen = flight_.frames[k].observations;
      if (k < kLight) seen.clear();
      for (Observation& o : seen) o.id += kNewTracks;
    }
  }
  bool isDark(size_t k) const {
    return (k >= kDark && k < kLight) || (k >= dark_again_ && k < light_again_);
  }
  /** Dark again, after as long as old keyframes do not show themselves. */
  void darken(size_t from, size_t to) {
    dark_again_ = from;
    light_again_ = to;
    for (size_t k = from; k < flight_.frames.size(); ++k) {
      auto& seen = flight_.frames[k].observations;
      if (k < to) seen.clear();
      for (Observation& o : seen) o.id += kNewTracks;
    }
  }

  void fly(const MapOptions& map, const SE3& elsewhere = {}) {
    FixedLagOptions options;
    options.imu_noise = flight_.imu_noise;
    if (accel_noise_ > 0.0) options.imu_noise.accel_noise_density = accel_noise_;
    const auto views = std::make_shared<LookingViews>(flight_);
    views->elsewhere_ = elsewhere;
    FixedLagOdometry odometry(flight_.calibration, options, map, views);
    FlightRecordOptions record_options;
    record_options.imu_noise = flight_.imu_noise;
    FlightRecord record(flight_.calibration, record_options);
    for (size_t k = 0; k < flight_.frames.size(); ++k) {
      const TrackedFrame& frame = flight_.frames[k];
      views->now_ = frame.t;
      std::vector<ImuSample> imu;
      if (k > 0) imu = flight_.between(k - 1, k);
      if (isDark(k))
        for (ImuSample& sample : imu) sample.accel.x() += wrong_;
      outputs_.push_back(k == 0 ? odometry.start(flight_.startAt(0, startSigma(), 7), frame)
                                : odometry.process(frame, imu));
      causal_.push_back({frame.t, outputs_[k].state.T_WB});
      record.add(frame.t, frame, imu, outputs_[k], &odometry);
    }
    smoothed_ = record.smoothedFlight(causal_);
  }

  double error(const Trajectory& of, size_t k) const {
    return (of[k].T_WB.t - flight_.truth[k].T_WB.t).norm();
  }
  double largestError(const Trajectory& of, size_t from, size_t to) const {
    double largest = 0.0;
    for (size_t k = from; k < to; ++k) largest = std::max(largest, error(of, k));
    return largest;
  }
  std::optional<size_t> recognizedAt() const {
    for (size_t k = 0; k < outputs_.size(); ++k)
      if (outputs_[k].recognition) return k;
    return std::nullopt;
  }

  double wrong_ = 0.05;       // m/s^2
  double accel_noise_ = 0.0;  // that the odometry believes in, m/s^2/sqrt(Hz); 0: the flight's
  size_t dark_again_ = 0, light_again_ = 0;
  SimulatedFlight flight_;
  std::vector<OdometryOutput> outputs_;
  Trajectory causal_, smoothed_;
};

TEST_F(AfterDarkness, TheFlightGoesBackToWhereTheOldKeyframesHaveIt) {
  fly({});
  const auto k = recognizedAt();
  ASSERT_TRUE(k);
  const Recognition& recognition = *outputs_[*k].recognition;
  EXPECT_EQ(recognition.after, flight_.frames[kDark - 1].t);
  EXPECT_LE(recognition.keyframe, recognition.after);
  EXPECT_GE(outputs_[*k].recalled.size(), 20U);
  const double before = error(causal_, *k - 1), after = largestError(causal_, *k, causal_.size());
  EXPECT_GT(before, 0.1);
  EXPECT_LT(after, 0.05);
  EXPECT_NEAR(recognition.T_WW0.t.norm(), before, 0.1 * before + 0.05);
  // The poses between the return of the images and the recognition go there, too.
  EXPECT_LT(largestError(smoothed_, kLight, *k), 0.03);
  // What the IMU told in the dark is bent to end there.
  EXPECT_LT(largestError(smoothed_, kDark, kLight), 0.3 * largestError(causal_, kDark, kLight));
}

TEST_F(AfterDarkness, WithoutItTheFlightStaysOff) {
  MapOptions map;
  map.relocalize = false;
  fly(map);
  EXPECT_FALSE(recognizedAt());
  EXPECT_GT(largestError(causal_, kLight + 5, kLight + 10), 0.1);
}

TEST_F(AfterDarkness, AKeyframeIsRecognisedThatThePredictionDoesNotShow) {
  wrong_ = 2.0;  // two metres are left when the images have shown the velocity
  accel_noise_ = 0.1;
  fly({});
  const auto k = recognizedAt();
  ASSERT_TRUE(k);
  EXPECT_GT(error(causal_, *k - 1), 2.0);
  EXPECT_LT(largestError(causal_, *k, causal_.size()), 0.05);
}

TEST_F(AfterDarkness, WhatTheFirstOfTwoSuchWhilesLeftIsMendedAfterTheSecond) {
  darken(kLight + 3, kLight + 18);
  fly({});
  const auto k = recognizedAt();
  ASSERT_TRUE(k);
  ASSERT_GE(*k, light_again_);
  EXPECT_EQ(outputs_[*k].recognition->after, flight_.frames[kDark - 1].t);
  EXPECT_LT(largestError(causal_, *k, causal_.size()), 0.05);
}

TEST_F(AfterDarkness, WhereAFewLandmarksStayInSightTheSmoothedFlightGoesBackToo) {
  for (size_t k = kDark; k < kLight; ++k) {  // three, too few to locate
    auto& seen = flight_.frames[k].observations;
    for (const Observation& o : flight_.frames[kDark - 1].observations)
      if (seen.size() < 3) seen.push_back(o);
  }
  fly({});
  const auto k = recognizedAt();
  ASSERT_TRUE(k);
  EXPECT_LT(largestError(smoothed_, kLight, *k), 0.05);
}

TEST_F(AfterDarkness, APlaceThatDeadReckoningCannotHaveReachedIsRefused) {
  fly({}, {Eigen::Matrix3d::Identity(), {0.0, 8.0, 0.0}});
  EXPECT_FALSE(recognizedAt());
}

}  // namespace
}  // namespace etalon
