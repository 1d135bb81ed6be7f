#include "etalon/ground_truth/smoothing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "simulated_truth.h"

namespace etalon::ground_truth {
namespace {

/** Where the rows were not smoothed there is nothing between those that are believed: nodes twice
 * as far apart as a low pass of 1 Hz wants are near enough, and four times as fast. */
GroundTruthSmoothingOptions coarse() {
  GroundTruthSmoothingOptions options;
  options.step_s = 0.25;
  return options;
}

GroundTruthSmoothing smoothed(const SimulatedTruth& truth) {
  const auto result = smoothGroundTruth(truth.recorded, truth.imu, ImuNoiseDensities(), coarse());
  EXPECT_TRUE(result) << result.error().reason;
  return result.value_or(GroundTruthSmoothing());
}

/** Squared error over squared standard error. */
double nees(const Measured& measured, double truth) {
  return std::pow((measured.value - truth) / measured.sigma, 2.0);
}

class ManyFlights : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    results_ = new std::vector<GroundTruthSmoothing>;
    for (std::uint64_t seed = 1; seed <= kFlights; ++seed)
      results_->push_back(smoothed(simulatedTruth(faults(), seed, kDurationS)));
  }
  static void TearDownTestSuite() { delete results_; }

  static Faults faults() { return {}; }
  static constexpr std::uint64_t kFlights = 3;
  static constexpr double kDurationS = 30.0;
  static std::vector<GroundTruthSmoothing>* results_;
};
std::vector<GroundTruthSmoothing>* ManyFlights::results_ = nullptr;

TEST_F(ManyFlights, OffsetsAreFoundWithinTheirStandardErrors) {
  double sum = 0.0;
  int count = 0;
  const auto add = [&](const Measured& measured, double truth) {
    const double one = nees(measured, truth);
    EXPECT_LT(one, 16.0) << measured.value << " +- " << measured.sigma << ", true " << truth;
    sum += one;
    ++count;
  };
  for (const GroundTruthSmoothing& result : *results_) {
    const BodyOffset& offset = result.offset;
    add(offset.position_shift_s, faults().position_shift_s);
    add(offset.rotation_shift_s, faults().rotation_shift_s);
    for (int i = 0; i < 3; ++i) {
      add({offset.turn_rad.value[i], offset.turn_rad.sigma[i]}, faults().turn[i]);
      add({offset.lever_m.value[i], offset.lever_m.sigma[i]}, faults().lever[i]);
    }
    // Gravity in G is R_GW (0, 0, -1).
    const Eigen::Vector3d down =
        -expSO3(Eigen::Vector3d(faults().tilt.x(), faults().tilt.y(), 0.0)).col(2);
    add(result.gravity_x_rad, down.x());
    add(result.gravity_y_rad, down.y());
  }
  // Thirty numbers, those of a flight correlated: the mean of right ones is 1 +- 0.3. The larger of
  // two standard errors makes it smaller.
  EXPECT_GT(sum / count, 0.35);
  EXPECT_LT(sum / count, 1.6);
}

TEST_F(ManyFlights, StandardErrorsAreOfUse) {
  for (const GroundTruthSmoothing& result : *results_) {
    EXPECT_LT(result.offset.position_shift_s.sigma, 2e-3);
    EXPECT_LT(result.offset.rotation_shift_s.sigma, 1e-3);
    EXPECT_LT(result.offset.turn_rad.sigma.maxCoeff(), radians(0.3));
    EXPECT_LT(result.offset.lever_m.sigma.maxCoeff(), 0.01);
    EXPECT_LT(result.tilt_rad.sigma, radians(0.2));
  }
}

TEST_F(ManyFlights, SizesOfTheErrorsAreFound) {
  for (const GroundTruthSmoothing& result : *results_) {
    // White and smooth errors together are what a row is off by: sqrt(1^2 + 2^2) = 2.24. Fifty rows
    // and an accelerometer that errs by as much over half a second tell it to a factor of two.
    const auto total = [](const ErrorModel& e) {
      return std::hypot(e.white.value, e.correlated.value);
    };
    EXPECT_GT(total(result.position_error), 1.1e-3);
    EXPECT_LT(total(result.position_error), 4.5e-3);
    EXPECT_GT(total(result.rotation_error), 1.1e-3);
    EXPECT_LT(total(result.rotation_error), 4.5e-3);
  }
}

TEST_F(ManyFlights, CorrectedOneIsBetterThanTheRecordedOne) {
  const SimulatedTruth truth = simulatedTruth(faults(), 1, kDurationS);
  const GroundTruthSmoothing& result = results_->front();
  ASSERT_GT(result.corrected.states.size(), 2500u);
  double turned = 0.0, recorded = 0.0;
  for (const StampedState& row : truth.recorded.states) {
    const auto better = result.corrected.at(row.t);
    if (!better) continue;
    const Eigen::Matrix3d R = truth.flight.at(row.t).T_WB.R;
    // Yaw of the world is the recorded one's: tilt alone is compared.
    const Eigen::Vector3d z = R.row(2).transpose();
    turned = std::max(turned, angleBetween(z, better->T_WB.R.row(2).transpose()));
    recorded = std::max(recorded, angleBetween(z, row.T_WB.R.row(2).transpose()));
  }
  EXPECT_LT(turned, 0.3 * recorded);
  EXPECT_LT(degrees(turned), 0.35);
}

TEST_F(ManyFlights, NothingMissingIsNoGap) { EXPECT_TRUE(results_->front().gaps.empty()); }

TEST(Smoothing, PerfectGroundTruthHasNothingWrong) {
  Faults none;
  none.position_shift_s = none.rotation_shift_s = 0.0;
  none.turn.setZero();
  none.lever.setZero();
  none.tilt.setZero();
  none.position_white = none.rotation_white = 1e-5;
  none.position_smooth = none.rotation_smooth = 0.0;
  const GroundTruthSmoothing result = smoothed(simulatedTruth(none, 7, 14.0));
  EXPECT_LT(nees(result.offset.position_shift_s, 0.0), 9.0);
  EXPECT_LT(nees(result.offset.rotation_shift_s, 0.0), 9.0);
  EXPECT_LT(std::abs(result.offset.position_shift_s.value), 2e-3);
  EXPECT_LT(result.offset.turn_rad.value.norm(), radians(0.05));
  EXPECT_LT(result.tilt_rad.value, radians(0.2));
}

TEST(Smoothing, GapsAreNamedAndNotFilled) {
  Faults faults;
  const TimeNs start = ProfileOptions().start;
  faults.gap_from = start + durationNs(8.0);
  faults.gap_to = start + durationNs(11.0);
  const SimulatedTruth truth = simulatedTruth(faults, 3, 18.0);
  const GroundTruthSmoothing result = smoothed(truth);
  ASSERT_EQ(result.gaps.size(), 1u);
  EXPECT_NEAR(result.gaps[0].length_s, 3.0, 0.11);
  EXPECT_FALSE(result.corrected.at(start + durationNs(9.5)));
  EXPECT_TRUE(result.corrected.at(start + durationNs(14.0)));
  EXPECT_LT(nees(result.offset.position_shift_s, faults.position_shift_s), 16.0);
}

// Correlated errors are three times as large as in the other flights, and slower.
TEST(Smoothing, CorrelatedErrorsAreToldFromWhiteOnes) {
  Faults faults;
  faults.position_white = 5e-4;
  faults.rotation_white = 5e-4;
  faults.position_smooth = faults.rotation_smooth = 6e-3;
  faults.smooth_time_s = 1.0;
  const GroundTruthSmoothing result = smoothed(simulatedTruth(faults, 5, 24.0));
  // A flight of 24 correlation times tells a standard deviation to 1 / sqrt(48) = 15 %, what the IMU
  // does not tell from it aside.
  for (const ErrorModel& error : {result.position_error, result.rotation_error}) {
    EXPECT_GT(error.correlated.value, 3e-3);
    EXPECT_LT(error.correlated.value, 12e-3);
    EXPECT_GT(error.correlated.value, 3.0 * error.white.value);
  }
  EXPECT_GT(result.rotation_error.correlation_time_s.value, 0.4);
  EXPECT_LT(result.rotation_error.correlation_time_s.value, 2.5);
  EXPECT_LT(nees(result.offset.position_shift_s, faults.position_shift_s), 9.0);
  EXPECT_LT(nees(result.offset.rotation_shift_s, faults.rotation_shift_s), 9.0);
}

// Rows within it would have no motion to be joined to.
TEST(Smoothing, AGapOfTheImuIsAGap) {
  SimulatedTruth truth = simulatedTruth({}, 6, 14.0);
  const TimeNs start = truth.imu.front().t;
  auto& imu = truth.imu;
  imu.erase(std::remove_if(imu.begin(), imu.end(),
                           [&](const ImuSample& sample) {
                             const double s = secondsBetween(start, sample.t);
                             return 6.0 < s && s < 6.8;
                           }),
            imu.end());
  const GroundTruthSmoothing result = smoothed(truth);
  ASSERT_EQ(result.gaps.size(), 1u);
  EXPECT_NEAR(result.gaps[0].length_s, 0.85, 0.06);
  EXPECT_LT(nees(result.offset.position_shift_s, Faults().position_shift_s), 9.0);
}

/** What a refusal says of `recorded` and `imu`. */
Refusal refusal(const GroundTruth& recorded, const std::vector<ImuSample>& imu) {
  const auto result = smoothGroundTruth(recorded, imu, ImuNoiseDensities(), coarse());
  EXPECT_FALSE(result);
  return result ? Refusal() : result.error();
}

TEST(Smoothing, TooShortAndUncoveredAreRefused) {
  const SimulatedTruth truth = simulatedTruth({}, 1, 15.0);
  GroundTruth first = truth.recorded;
  first.states.resize(100);  // 5 s
  const Refusal too_short = refusal(first, truth.imu);
  EXPECT_EQ(too_short.status, RefusalStatus::kInvalidInput);
  EXPECT_EQ(too_short.bound, 10.0);
  EXPECT_EQ(refusal(truth.recorded, {}).status, RefusalStatus::kImuGap);
  EXPECT_EQ(refusal({}, truth.imu).status, RefusalStatus::kImuGap);
}

TEST(Smoothing, OtherTimesAreRefusedWithTheirNumber) {
  SimulatedTruth truth = simulatedTruth({}, 1, 15.0);
  for (StampedState& row : truth.recorded.states) row.t += durationNs(3600.0);
  const Refusal elsewhere = refusal(truth.recorded, truth.imu);
  EXPECT_EQ(elsewhere.status, RefusalStatus::kImuGap);
  EXPECT_EQ(elsewhere.value, 0.0);
  EXPECT_EQ(elsewhere.bound, 20.0);
}

TEST(Smoothing, WhatIsNoTrajectoryIsRefused) {
  const SimulatedTruth truth = simulatedTruth({}, 1, 15.0);
  GroundTruth broken = truth.recorded;
  broken.states[100].T_WB.t.y() = std::nan("");
  EXPECT_EQ(refusal(broken, truth.imu).status, RefusalStatus::kInvalidInput);
  broken = truth.recorded;
  std::swap(broken.states[100], broken.states[150]);
  EXPECT_EQ(refusal(broken, truth.imu).status, RefusalStatus::kInvalidInput);
}

}  // namespace
}  // namespace etalon::ground_truth
