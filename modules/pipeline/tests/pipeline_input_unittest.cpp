// What the pipeline does with measurements that are broken: it drops or bridges them, and says so.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "etalon/pipeline/pipeline.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class PipelineInput : public ::testing::Test {
 protected:
  static const Flight& flight() { return Flight::instance(); }

  static Pipeline pipeline(const Script& script, const WindowOptions& window = {},
                           size_t history_frames = 0,
                           const StereoInertialCalibration& calibration = flight().calibration) {
    PipelineOptions options;
    options.window = window;
    options.history_frames = history_frames;
    options.keyframes = 3;
    options.keyframe_rate_hz = kFrameRateHz;
    PipelineInitializers initializers;
    initializers.name = "scripted";
    initializers.initializer = std::make_shared<Scripted>(script);
    return {calibration, options, initializers};
  }
  static Pipeline pipeline() {
    return pipeline([](const InitializationProblem&) {
      return refuse(RefusalStatus::kNotConverged, "as it always does");
    });
  }

  /** What the script says counts as it is. */
  static WindowOptions unrefined() {
    WindowOptions window;
    window.refine = false;
    return window;
  }

  /** The flight's frames with the IMU up to each of them. */
  static void add(Pipeline* pipeline, const std::vector<StereoFrame>& frames,
                  const std::vector<ImuSample>& imu) {
    size_t next = 0;
    for (const StereoFrame& frame : frames) {
      while (next < imu.size() && imu[next].t <= frame.t) pipeline->add(imu[next++]);
      pipeline->add(frame);
    }
    pipeline->finish();
  }

  static void flySevenTimes(Pipeline* pipeline) {
    std::vector<StereoFrame> frames;
    std::vector<ImuSample> imu;
    for (int round = 0; round < 7; ++round) {
      const TimeNs later = round * TimeNs{800'000'000};  // frames follow each other without a gap
      for (StereoFrame frame : flight().frames) {
        frame.t += later;
        frames.push_back(frame);
      }
      for (ImuSample sample : flight().imu) {
        sample.t += later;
        if (imu.empty() || sample.t > imu.back().t) imu.push_back(sample);
      }
    }
    add(pipeline, frames, imu);
  }

  static int count(const Pipeline& pipeline, InputFault fault) {
    const InputFaultCounts faults = pipeline.inputFaults();
    const auto found = faults.find(fault);
    return found == faults.end() ? 0 : found->second.count;
  }

  /** How far the motion from the first to the last frame is off, m. */
  static double motionError(const Trajectory& trajectory) {
    const std::vector<StereoFrame>& frames = flight().frames;
    const SE3 truth = flight().truth(frames.front().t).inverse() * flight().truth(frames.back().t);
    const SE3 motion = trajectory.front().T_WB.inverse() * trajectory.back().T_WB;
    return (motion.t - truth.t).norm();
  }
};

TEST_F(PipelineInput, BadMeasurementsChangeNothingButTheCounts) {
  Pipeline clean = pipeline();
  add(&clean, flight().frames, flight().imu);
  EXPECT_THAT(clean.inputFaults(), IsEmpty());

  Pipeline spoilt = pipeline();
  size_t next = 0;
  for (size_t k = 0; k < flight().frames.size(); ++k) {
    const StereoFrame& frame = flight().frames[k];
    for (; next < flight().imu.size() && flight().imu[next].t <= frame.t; ++next) {
      ImuSample sample = flight().imu[next];
      EXPECT_NO_THROW(spoilt.add(sample));
      EXPECT_NO_THROW(spoilt.add(sample));  // again
      sample.t += 1'000'000;
      sample.gyro.x() = std::numeric_limits<double>::quiet_NaN();
      EXPECT_NO_THROW(spoilt.add(sample));
      sample.gyro.x() = 1e30;
      EXPECT_NO_THROW(spoilt.add(sample));
    }
    EXPECT_NO_THROW(spoilt.add(frame));
    StereoFrame other = frame;
    other.t += 60;  // within the tick of 100 ns
    EXPECT_NO_THROW(spoilt.add(other));
    other.t = frame.t - 50'000'000;
    if (k > 0) spoilt.add(other);
  }
  const int n = next;
  EXPECT_EQ(count(spoilt, InputFault::kImuRepeatedStamp), n);
  EXPECT_EQ(count(spoilt, InputFault::kImuNotFinite), n);
  EXPECT_EQ(count(spoilt, InputFault::kImuTooLarge), n);
  EXPECT_EQ(count(spoilt, InputFault::kFrameRepeatedStamp), kFrames);
  EXPECT_EQ(count(spoilt, InputFault::kFrameFromThePast), kFrames - 1);
  ASSERT_EQ(spoilt.trajectory().size(), clean.trajectory().size());
  for (size_t k = 0; k < clean.trajectory().size(); ++k) {
    EXPECT_EQ(spoilt.trajectory()[k].t, clean.trajectory()[k].t);
    EXPECT_EQ(spoilt.trajectory()[k].T_WB.t, clean.trajectory()[k].T_WB.t);
  }
}

TEST_F(PipelineInput, ACameraThatHangsInMotionIsNotBelieved) {
  std::vector<StereoFrame> frames = flight().frames;
  for (const size_t k : {4U, 5U, 6U}) {
    frames[k].left = frames[3].left;
    frames[k].right = frames[3].right;
  }
  Pipeline pipeline = this->pipeline();
  add(&pipeline, frames, flight().imu);
  EXPECT_EQ(count(pipeline, InputFault::kFrameRepeatsImage), 3);
  EXPECT_EQ(pipeline.framesNotLocated(), 3);
  ASSERT_EQ(pipeline.trajectory().size(), frames.size());
  // The poses between are predictions and go on moving.
  for (const size_t k : {4U, 5U, 6U})
    EXPECT_GT((pipeline.trajectory()[k].T_WB.t - pipeline.trajectory()[k - 1].T_WB.t).norm(), 0.01);
  // The next new image is located from where the tracks were: 1 % of a path of about 1 m.
  EXPECT_LT(motionError(pipeline.trajectory()), 0.01);
}

TEST_F(PipelineInput, AJumpOfTheClockLeavesTheTrajectoryWhereItIs) {
  constexpr TimeNs kJump = 100'000'000 * kNanosecondsPerSecond;
  const TimeNs middle = flight().frames[3].t;
  std::vector<StereoFrame> frames = flight().frames;
  std::vector<ImuSample> imu = flight().imu;
  for (StereoFrame& frame : frames)
    if (frame.t > middle) frame.t += kJump;
  for (ImuSample& sample : imu)
    if (sample.t > middle) sample.t += kJump;
  Pipeline pipeline = this->pipeline();
  add(&pipeline, frames, imu);
  EXPECT_EQ(count(pipeline, InputFault::kImuJump), 1);
  EXPECT_EQ(count(pipeline, InputFault::kFrameJump), 1);
  ASSERT_EQ(pipeline.trajectory().size(), frames.size());
  EXPECT_LT(motionError(pipeline.trajectory()), 0.01);
  // No window of keyframes reaches across the jump.
  for (const InitializationAttempt& attempt : pipeline.attempts())
    EXPECT_LT(attempt.keyframes.back() - attempt.keyframes.front(), kNanosecondsPerSecond);
}

TEST_F(PipelineInput, AClockThatStepsBackIsSaidAndTheTrajectoryGoesOnWhenItHasCaughtUp) {
  constexpr TimeNs kBack = 250'000'000;
  const TimeNs middle = flight().frames[3].t;
  std::vector<StereoFrame> frames = flight().frames;
  std::vector<ImuSample> imu = flight().imu;
  for (StereoFrame& frame : frames)
    if (frame.t > middle) frame.t -= kBack;
  for (ImuSample& sample : imu)
    if (sample.t > middle) sample.t -= kBack;
  Pipeline pipeline = this->pipeline(trueInitialization, unrefined());
  auto sample = imu.begin();
  for (size_t k = 0; k < frames.size(); ++k) {  // in the order of the measurements
    for (; sample != imu.end() && sample - imu.begin() <= 20 * static_cast<int>(k); ++sample)
      pipeline.add(*sample);
    pipeline.add(frames[k]);
  }
  pipeline.finish();
  EXPECT_EQ(count(pipeline, InputFault::kImuStepBack), 1);
  std::vector<std::string> remarks;
  for (const PipelineEvent& event : pipeline.events())
    if (event.remark) remarks.push_back(event.reason);
  ASSERT_FALSE(remarks.empty());
  EXPECT_EQ(remarks[0],
            "the IMU's stamps step back by 0.25 s: samples are refused until they catch up");
  // Frames 4 and 5 are from the past; those after them have their own stamps.
  ASSERT_EQ(pipeline.estimates().size(), frames.size() - 2);
  EXPECT_EQ(pipeline.estimates()[4].t, frames[6].t);
  for (size_t k = 1; k < pipeline.estimates().size(); ++k)
    EXPECT_GT(pipeline.estimates()[k].t, pipeline.estimates()[k - 1].t);
  EXPECT_LT(motionError(pipeline.trajectory()), 0.02);
}

TEST_F(PipelineInput, ADataSheetWithoutRandomWalksIsFlownAllTheSame) {
  StereoInertialCalibration calibration = flight().calibration;
  calibration.imu.noise.gyro_random_walk = calibration.imu.noise.accel_random_walk = 0.0;
  Pipeline pipeline = this->pipeline(trueInitialization, unrefined(), 0, calibration);
  add(&pipeline, flight().frames, flight().imu);
  EXPECT_TRUE(pipeline.initializedAt());
  EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
  EXPECT_LT(motionError(pipeline.trajectory()), 0.02);
}

TEST_F(PipelineInput, WithoutImuFramesAreProcessedAllTheSame) {
  Pipeline pipeline = this->pipeline();
  for (int round = 0; round < 5; ++round)
    for (StereoFrame frame : flight().frames) {
      frame.t += round * kNanosecondsPerSecond;
      pipeline.add(frame);
    }
  // One second of frames waits: at 10 Hz with a pause of 0.2 s in each.
  EXPECT_GE(pipeline.trajectory().size(), 5U * kFrames - 10U);
  EXPECT_EQ(static_cast<size_t>(count(pipeline, InputFault::kFrameWithoutImu)),
            pipeline.trajectory().size());
}

TEST_F(PipelineInput, ADriverMayUseItsImagesAgainWhileTheFrameWaitsForTheImu) {
  const auto fly = [](bool again) {
    Pipeline pipeline = PipelineInput::pipeline(trueInitialization, unrefined());
    StereoFrame buffer = flight().frames.front();
    if (again) buffer.left = buffer.left.clone(), buffer.right = buffer.right.clone();
    auto sample = flight().imu.begin();
    for (StereoFrame frame : flight().frames) {
      frame.t += durationNs(0.001);  // the next sample comes 4 ms later
      for (; sample != flight().imu.end() && sample->t <= frame.t; ++sample) pipeline.add(*sample);
      if (!again) {
        pipeline.add(frame);
        continue;
      }
      frame.left.copyTo(buffer.left);
      frame.right.copyTo(buffer.right);
      buffer.t = frame.t;
      pipeline.add(buffer);
      buffer.left.setTo(0);
      buffer.right.setTo(0);
    }
    for (; sample != flight().imu.end(); ++sample) pipeline.add(*sample);
    pipeline.finish();
    EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
    return pipeline.trajectory();
  };
  const Trajectory kept = fly(false), used_again = fly(true);
  ASSERT_EQ(kept.size(), flight().frames.size());
  ASSERT_EQ(used_again.size(), kept.size());
  for (size_t k = 0; k < kept.size(); ++k)  // the same pixels: the same numbers
    EXPECT_EQ(used_again[k].T_WB.matrix(), kept[k].T_WB.matrix()) << k;
}

TEST_F(PipelineInput, ImagesThatNobodyElseHoldsAreNotCopied) {
  Pipeline pipeline = this->pipeline();
  std::vector<const uchar*> processed;
  pipeline.onTracks(
      [&processed](const FrontFrame& frame) { processed.push_back(frame.images.left.data); });
  for (const ImuSample& sample : flight().imu) pipeline.add(sample);
  StereoFrame given = flight().frames[0];
  given.left = given.left.clone();
  given.right = given.right.clone();
  const uchar* const pixels = given.left.data;
  pipeline.add(std::move(given));
  StereoFrame shared = flight().frames[1];
  pipeline.add(std::move(shared));  // the flight has them, too
  EXPECT_THAT(processed, ElementsAre(pixels, ::testing::Ne(flight().frames[1].left.data)));
}

TEST_F(PipelineInput, ImagesFromBeforeTheImuDoNotHoldUpTheStart) {
  PipelineOptions options;
  options.window = unrefined();
  options.keyframes = 7;
  options.min_keyframes = 3;
  options.keyframe_rate_hz = kFrameRateHz;
  PipelineInitializers initializers;
  initializers.name = "scripted";
  initializers.initializer = std::make_shared<Scripted>(trueInitialization);
  Pipeline pipeline(flight().calibration, options, initializers);
  std::vector<ImuSample> late;
  for (const ImuSample& sample : flight().imu)
    if (sample.t > flight().frames[2].t) late.push_back(sample);
  add(&pipeline, flight().frames, late);
  ASSERT_TRUE(pipeline.initializedAt());
  // The first window of three keyframes that the IMU covers; the next one confirms it.
  ASSERT_FALSE(pipeline.attempts().empty());
  EXPECT_EQ(pipeline.attempts().front().keyframes.front(), flight().frames[3].t);
  EXPECT_EQ(pipeline.attempts().front().t, flight().frames[5].t);
  EXPECT_LE(*pipeline.initializedAt(), flight().frames[6].t);
}

TEST_F(PipelineInput, OldRefusalsLoseTheirEstimatesAndKeepTheirReason) {
  WindowOptions hard_to_please;
  hard_to_please.acceptance.min_measurements = 1'000'000;
  Pipeline pipeline = this->pipeline(
      [](const InitializationProblem& problem) {
        Initialization truth;
        for (const TrackedFrame* keyframe : problem.keyframes())
          truth.states.push_back({keyframe->t, flight().truth(keyframe->t)});
        return truth;
      },
      hard_to_please);
  flySevenTimes(&pipeline);
  const std::vector<InitializationAttempt>& attempts = pipeline.attempts();
  ASSERT_GT(attempts.size(), Starter::kDetailedAttempts);
  for (size_t i = 0; i < attempts.size(); ++i) {
    EXPECT_EQ(attempts[i].init.has_value(), i + Starter::kDetailedAttempts >= attempts.size());
    EXPECT_EQ(attempts[i].decision.error().status, RefusalStatus::kTooFewTracks);
    EXPECT_EQ(attempts[i].keyframes.size(), 3U);
  }
}

TEST_F(PipelineInput, OfAFlightWithoutEndTheNewestEventsAndRefusalsAreKept) {
  const Script refusing = [](const InitializationProblem&) {
    return refuse(RefusalStatus::kNotConverged, "as it always does");
  };
  Pipeline remembering = pipeline(refusing), forgetting = pipeline(refusing, {}, 10);
  flySevenTimes(&remembering);
  flySevenTimes(&forgetting);
  EXPECT_EQ(remembering.attempts().size(), remembering.attemptCount());
  EXPECT_EQ(forgetting.attemptCount(), remembering.attemptCount());
  EXPECT_GE(forgetting.attempts().size(), 10U);
  EXPECT_LT(forgetting.attempts().size(), 20U);
  EXPECT_EQ(forgetting.attempts().back().t, remembering.attempts().back().t);
  EXPECT_EQ(remembering.events().front().t, flight().frames.front().t);
  for (const PipelineEvent& event : forgetting.events())
    EXPECT_GE(event.t, forgetting.estimates().front().t);
}

/** A frame behind a gap waits at the border for the one after it. Meanwhile dead reckoning ends. */
TEST_F(PipelineInput, AFrameFromBeforeTheEndOfDeadReckoningIsDropped) {
  PipelineOptions options;
  options.window = unrefined();
  options.keyframes = 3;
  options.keyframe_rate_hz = kFrameRateHz;
  options.input.max_gap_s = 0.12;
  options.max_dead_reckoning_s = 0.25;
  PipelineInitializers initializers;
  initializers.name = "truth";
  initializers.initializer = std::make_shared<Scripted>(trueInitialization);
  Pipeline pipeline(flight().calibration, options, initializers);
  std::vector<StereoFrame> frames = flight().frames;
  frames.erase(frames.begin() + 4);  // at 0.4 s
  auto sample = flight().imu.begin();
  for (size_t k = 0; k < frames.size(); ++k) {
    // That at 0.5 s is held until the one at 0.6 s comes, which is late.
    const TimeNs until = frames[k].t + (k == 5 ? durationNs(0.09) : 0);
    for (; sample != flight().imu.end() && sample->t <= until; ++sample) pipeline.add(*sample);
    pipeline.add(frames[k]);
  }
  pipeline.finish();
  const InputFaultCounts faults = pipeline.inputFaults();
  ASSERT_EQ(faults.count(InputFault::kFrameFromThePast), 1U);
  EXPECT_EQ(faults.at(InputFault::kFrameFromThePast).first, frames[4].t);
  for (const FrameEstimate& estimate : pipeline.estimates()) EXPECT_NE(estimate.t, frames[4].t);
  EXPECT_EQ(pipeline.estimates().size(), frames.size() - 1);
  bool lost = false;
  for (const PipelineEvent& event : pipeline.events())
    lost = lost || (event.state == PipelineState::kLost && event.t < frames[5].t);
  EXPECT_TRUE(lost);
}

}  // namespace
}  // namespace etalon::pipeline_test
