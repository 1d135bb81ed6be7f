#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "scripted_flight.h"

namespace etalon::pipeline_test {

namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

/** Images stamped 20 ms late; the initializer refuses until it is given the IMU of their instants,
 * and then says the truth. */
std::unique_ptr<Pipeline> flownLate(CalibrationMode mode, int most_keyframes = kFrames - 1,
                                    double imu_from_s = 0.0) {
  constexpr TimeNs kLate = 20'000'000;
  const Flight& flight = Flight::instance();
  PipelineOptions options;
  options.keyframes = most_keyframes;
  options.min_keyframes = kFrames - 1;
  options.keyframe_rate_hz = kFrameRateHz;
  options.window.refine = false;
  options.window.acceptance.false_alarm_rate = 0.0;  // a window need not be confirmed
  options.fixed_lag.calibration.time_offset = mode;
  PipelineInitializers initializers;
  initializers.name = "late";
  initializers.initializer = std::make_shared<Scripted>([&](const InitializationProblem& problem) {
    const TimeNs first = problem.keyframe(0).t;
    const ImuBuffer imu(flight.imu);
    const auto truth = imu.between(first - kLate, first);
    const Vector3d there = problem.imu().samples().front().gyro;
    if ((there - truth.front().gyro).norm() > 0.1 * (there - truth.back().gyro).norm())
      return InitializationResult(refuse(RefusalStatus::kNotConverged, "the gyro disagrees"));
    InitializationResult result = trueInitialization(problem);
    for (StampedState& state : result->states) {
      const auto taken = flight.trajectory.at(state.t - kLate);
      state.T_WB = taken.T_WB;
      state.v_WB = taken.v_WB;
    }
    return result;
  });
  auto pipeline = std::make_unique<Pipeline>(flight.calibration, options, initializers);
  for (const ImuSample& sample : flight.imu)
    if (secondsBetween(flight.imu.front().t, sample.t) >= imu_from_s) pipeline->add(sample);
  for (StereoFrame frame : flight.frames) {
    frame.t += kLate;
    pipeline->add(frame);
  }
  pipeline->finish();
  return pipeline;
}

TEST(LateStamps, AreSaidAndCorrectedAtTheStart) {
  const auto late = flownLate(CalibrationMode::kAuto);
  const Pipeline& pipeline = *late;
  ASSERT_EQ(pipeline.attempts().size(), 2U);
  const InitializationAttempt &refused = pipeline.attempts()[0], &accepted = pipeline.attempts()[1];
  ASSERT_TRUE(refused.time_offset.has_value());
  EXPECT_NEAR(refused.time_offset->offset_s, -0.02, 3.0 * refused.time_offset->sigma_s);
  EXPECT_EQ(refused.time_offset_used_s, 0.0);
  EXPECT_THAT(refused.decision.error().reason,
              HasSubstr("the gyro disagrees; by the rotations of images and gyro the stamps"));
  EXPECT_TRUE(accepted.accepted());
  EXPECT_EQ(accepted.time_offset_used_s, refused.time_offset->offset_s);
  ASSERT_EQ(pipeline.events().size(), 3U);
  EXPECT_TRUE(pipeline.events()[1].remark);
  EXPECT_THAT(pipeline.events()[1].reason, HasSubstr("too late; corrected from here on"));
  EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
  for (const CalibrationFinding& finding : pipeline.calibrationFindings()) {
    if (finding.group != "time_offset") continue;
    EXPECT_NEAR(finding.used[0], 1e3 * accepted.time_offset_used_s, 1e-9);
  }
  // Where the platform is at the stamp, not at the image, 20 ms of 1 m/s before.
  EXPECT_LT(positionError(pipeline.estimates().back()), 0.01);
}

TEST(LateStamps, AnImageTakenBeforeTheImuBeganLeavesTheWindowOnceTheStampsAreKnownToBeLate) {
  // The IMU begins 10 ms after the first image was taken, 10 ms before its stamp.
  const auto late = flownLate(CalibrationMode::kAuto, kFrames, 0.01);
  ASSERT_EQ(late->attempts().size(), 2U);
  EXPECT_EQ(late->attempts()[0].keyframes.front(), Flight::instance().frames[0].t + 20'000'000);
  EXPECT_EQ(late->attempts()[1].keyframes.front(), Flight::instance().frames[1].t + 20'000'000);
  EXPECT_TRUE(late->attempts()[1].accepted());
}

TEST(LateStamps, ThatAreToBeTakenAsGivenAreNotCorrected) {
  const auto late = flownLate(CalibrationMode::kOff);
  const Pipeline& pipeline = *late;
  ASSERT_EQ(pipeline.attempts().size(), 2U);
  for (const InitializationAttempt& attempt : pipeline.attempts()) {
    EXPECT_FALSE(attempt.accepted());
    EXPECT_TRUE(attempt.time_offset.has_value());
    EXPECT_EQ(attempt.time_offset_used_s, 0.0);
  }
  EXPECT_EQ(pipeline.events().size(), 1U);
}

}  // namespace

}  // namespace etalon::pipeline_test
