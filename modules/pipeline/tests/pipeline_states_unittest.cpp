#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include "etalon/core/so3.h"
#include "etalon/pipeline/pipeline.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {

namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr size_t kStateWindow = 3;  // keyframes

/** A pipeline whose initializer says the truth, in flight, and the fixed-lag odometry after it. */
class PipelineStates : public ::testing::Test {
 protected:
  static const Flight& flight() { return Flight::instance(); }

  static Pipeline pipeline(double max_dead_reckoning_s = 5.0, double sigma_px = 0.35) {
    PipelineOptions options;
    options.window.odometry.sigma_px = sigma_px;
    options.keyframes = kStateWindow;
    options.keyframe_rate_hz = kFrameRateHz;
    options.window.refine = false;  // what the script says counts as it is
    options.max_dead_reckoning_s = max_dead_reckoning_s;
    PipelineInitializers initializers;
    initializers.name = "truth";
    initializers.initializer = std::make_shared<Scripted>(trueInitialization);
    return {flight().calibration, options, initializers};
  }

  /** All frames, those in [first, last) with their lenses covered. */
  static void fly(Pipeline* pipeline, size_t first = 0, size_t last = 0) {
    for (const ImuSample& sample : flight().imu) pipeline->add(sample);
    for (size_t k = 0; k < flight().frames.size(); ++k) {
      StereoFrame frame = flight().frames[k];
      if (k >= first && k < last) {
        // Never the same image twice: that would be a camera that hangs.
        const cv::Scalar grey(static_cast<double>(k % 4));
        frame.left = cv::Mat(frame.left.size(), CV_8UC1, grey);
        frame.right = cv::Mat(frame.right.size(), CV_8UC1, grey);
      }
      pipeline->add(frame);
    }
    pipeline->finish();
  }

  /** All frames; from frame `first` to before `last`, these cameras repeat their images. */
  static void flyHanging(std::array<bool, 2> cameras, size_t first, size_t last,
                         Pipeline* pipeline) {
    for (const ImuSample& sample : flight().imu) pipeline->add(sample);
    for (size_t k = 0; k < flight().frames.size(); ++k) {
      StereoFrame frame = flight().frames[k];
      const StereoFrame& before = flight().frames[first - 1];
      const bool hangs = k >= first && k < last;
      if (hangs && cameras[0]) frame.left = before.left;
      if (hangs && cameras[1]) frame.right = before.right;
      pipeline->add(frame);
    }
    pipeline->finish();
  }
};

TEST_F(PipelineStates, StereoOdometryRunsUntilTheStartAndTheFixedLagOdometryFromThere) {
  Pipeline pipeline = this->pipeline();
  EXPECT_EQ(pipeline.state(), PipelineState::kWaiting);
  fly(&pipeline);
  ASSERT_EQ(pipeline.estimates().size(), flight().frames.size());
  ASSERT_EQ(pipeline.trajectory().size(), flight().frames.size());
  ASSERT_EQ(pipeline.events().size(), 2U);
  EXPECT_EQ(pipeline.events()[0].state, PipelineState::kVisual);
  EXPECT_EQ(pipeline.events()[0].t, flight().frames[0].t);
  EXPECT_EQ(pipeline.events()[1].state, PipelineState::kInertial);
  EXPECT_EQ(pipeline.events()[1].t, flight().frames[kStateWindow - 1].t);
  EXPECT_EQ(pipeline.initializedAt(), flight().frames[kStateWindow - 1].t);
  for (size_t k = 0; k < pipeline.estimates().size(); ++k) {
    const FrameEstimate& estimate = pipeline.estimates()[k];
    EXPECT_EQ(estimate.t, flight().frames[k].t);
    EXPECT_EQ(pipeline.trajectory()[k].T_WB.t, estimate.nav.T_WB.t);
    EXPECT_EQ(estimate.state,
              k + 1 < kStateWindow ? PipelineState::kVisual : PipelineState::kInertial);
    EXPECT_EQ(estimate.sigma().allFinite(), k + 1 >= kStateWindow);
    EXPECT_LT(positionError(estimate), 0.01);  // 1 % of a path of about 1 m
    if (k + 1 < kStateWindow) continue;
    EXPECT_LT((estimate.nav.v_WB - flight().trajectory.at(estimate.t).v_WB).norm(), 0.03);
  }
}

TEST_F(PipelineStates, WhatTheFlightSaysOfTheCalibrationIsThereFromTheStartOn) {
  Pipeline pipeline = this->pipeline();
  EXPECT_TRUE(pipeline.calibrationFindings().empty());
  EXPECT_EQ(pipeline.calibrationInUse().cameras[1].T_BC.matrix(),
            flight().calibration.cameras[1].T_BC.matrix());
  fly(&pipeline);
  std::vector<std::string> groups;
  for (const CalibrationFinding& finding : pipeline.calibrationFindings()) {
    if (groups.empty() || groups.back() != finding.group) groups.push_back(finding.group);
    EXPECT_TRUE(finding.used.isZero(0.0)) << finding.words;  // it is right
  }
  EXPECT_EQ(groups, (std::vector<std::string>{"time_offset", "extrinsics", "intrinsics"}));
  EXPECT_TRUE(pipeline.calibrationInUse().cameras[0].model ==
              flight().calibration.cameras[0].model);
}

TEST_F(PipelineStates, AWindowGrowsUntilTheOneBeforeAgrees) {
  PipelineOptions options;
  options.min_keyframes = kStateWindow;
  options.keyframes = kStateWindow + 3;
  options.keyframe_rate_hz = kFrameRateHz;
  options.window.refine = false;
  PipelineInitializers initializers;
  initializers.name = "truth but for the fourth keyframe";
  initializers.initializer = std::make_shared<Scripted>([](const InitializationProblem& problem) {
    InitializationResult result = trueInitialization(problem);
    if (problem.keyframeCount() == kStateWindow + 1) result->bias.gyro.x() = 1.0;
    return result;
  });
  Pipeline pipeline(flight().calibration, options, initializers);
  fly(&pipeline);
  // Three keyframes have nothing to compare with, four contradict them, five contradict the four.
  ASSERT_EQ(pipeline.attempts().size(), 4U);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(pipeline.attempts()[i].keyframes.size(), kStateWindow + i);
    EXPECT_EQ(pipeline.attempts()[i].keyframes.front(), flight().frames[0].t);
    EXPECT_EQ(pipeline.attempts()[i].accepted(), i == 3);
  }
  EXPECT_EQ(pipeline.attempts()[0].decision.error().status, RefusalStatus::kTooFewKeyframes);
  EXPECT_EQ(pipeline.attempts()[1].decision.error().status, RefusalStatus::kImplausible);
  EXPECT_EQ(pipeline.attempts()[2].decision.error().status, RefusalStatus::kImplausible);
  EXPECT_EQ(pipeline.initializedAt(), flight().frames[kStateWindow + 2].t);
}

TEST_F(PipelineStates, TheFixedLagOdometryBelievesThePixelsAsConfigured) {
  // The start is the same, whatever the pixels: what differs is what is made of them after it.
  Pipeline as_usual = pipeline(), noisy = pipeline(5.0, 3.5);
  fly(&as_usual);
  fly(&noisy);
  EXPECT_GT(noisy.estimates().back().sigma().segment<3>(3).norm(),
            1.5 * as_usual.estimates().back().sigma().segment<3>(3).norm());
}

TEST_F(PipelineStates, WhatComesAfterTheEndIsIgnored) {
  Pipeline pipeline = this->pipeline();
  fly(&pipeline);
  const size_t poses = pipeline.trajectory().size(), events = pipeline.events().size();
  const TimeNs step = flight().frames[1].t - flight().frames[0].t;
  ImuSample sample = flight().imu.back();
  StereoFrame frame = flight().frames.back();
  sample.t += 2 * step;
  frame.t += step;
  pipeline.add(sample);
  pipeline.add(frame);
  pipeline.finish();
  EXPECT_EQ(pipeline.trajectory().size(), poses);
  EXPECT_EQ(pipeline.events().size(), events);
  EXPECT_TRUE(pipeline.inputFaults().empty());
}

TEST_F(PipelineStates, FramesWaitForTheImu) {
  Pipeline pipeline = this->pipeline();
  for (size_t k = 0; k < 3; ++k) pipeline.add(flight().frames[k]);
  EXPECT_TRUE(pipeline.trajectory().empty());
  for (const ImuSample& sample : flight().imu)
    if (sample.t <= flight().frames[1].t) pipeline.add(sample);
  EXPECT_EQ(pipeline.trajectory().size(), 2U);
}

TEST_F(PipelineStates, TheImuCarriesThePoseWhileTheLensesAreCovered) {
  Pipeline pipeline = this->pipeline();
  fly(&pipeline, 4, 6);
  ASSERT_EQ(pipeline.events().size(), 4U);
  EXPECT_EQ(pipeline.events()[2].state, PipelineState::kDeadReckoning);
  EXPECT_EQ(pipeline.events()[2].t, flight().frames[4].t);
  EXPECT_THAT(pipeline.events()[2].reason, HasSubstr("no landmark"));
  EXPECT_EQ(pipeline.events()[3].state, PipelineState::kInertial);
  // The first images after it show new landmarks, which locate the frame after that.
  EXPECT_EQ(pipeline.events()[3].t, flight().frames[7].t);
  EXPECT_EQ(pipeline.framesNotLocated(), 3);
  for (const FrameEstimate& estimate : pipeline.estimates())
    EXPECT_LT(positionError(estimate), 0.02);
  // The position's sigma grows over frames 3, 4, 5.
  for (const size_t k : {4U, 5U})
    EXPECT_GT(pipeline.estimates()[k].sigma().segment<3>(3).norm(),
              pipeline.estimates()[k - 1].sigma().segment<3>(3).norm());
}

TEST_F(PipelineStates, CamerasThatHangBrieflyAreLikeImagesThatDoNotCome) {
  Pipeline pipeline = this->pipeline();
  flyHanging({true, true}, 4, 6, &pipeline);
  EXPECT_EQ(pipeline.inputFaults().at(InputFault::kFrameRepeatsImage).count, 2);
  for (const PipelineEvent& event : pipeline.events())
    EXPECT_NE(event.state, PipelineState::kDeadReckoning) << event.reason;
  EXPECT_GT(pipeline.estimates()[5].sigma().segment<3>(3).norm(),
            pipeline.estimates()[3].sigma().segment<3>(3).norm());
}

TEST_F(PipelineStates, OneCameraThatHangsLeavesTheOther) {
  for (const bool left : {true, false}) {
    Pipeline pipeline = this->pipeline();
    flyHanging({left, !left}, 4, kFrames, &pipeline);
    const InputFaultCounts faults = pipeline.inputFaults();
    EXPECT_EQ(faults.at(InputFault::kImageRepeated).count, static_cast<int>(kFrames - 4));
    EXPECT_EQ(faults.count(InputFault::kFrameRepeatsImage), 0U);
    EXPECT_EQ(pipeline.framesNotLocated(), 0);
    EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
    ASSERT_EQ(pipeline.events().size(), 4U);
    EXPECT_THAT(pipeline.events()[2].reason,
                HasSubstr(left ? "left camera sees nothing" : "right camera sees nothing"));
    for (const FrameEstimate& estimate : pipeline.estimates())
      EXPECT_LT(positionError(estimate), 0.02);
  }
}

TEST_F(PipelineStates, LostItStartsAgainInTheSameWorld) {
  Pipeline pipeline = this->pipeline(0.15);
  fly(&pipeline, 3, 5);
  std::vector<PipelineState> states;
  for (const PipelineEvent& event : pipeline.events()) states.push_back(event.state);
  EXPECT_EQ(states, (std::vector<PipelineState>{PipelineState::kVisual, PipelineState::kInertial,
                                                PipelineState::kDeadReckoning, PipelineState::kLost,
                                                PipelineState::kInertial}));
  EXPECT_EQ(pipeline.events()[3].t, flight().frames[4].t);
  EXPECT_THAT(pipeline.events()[3].reason, HasSubstr("0.2 s"));
  const PipelineEvent& again = pipeline.events().back();
  EXPECT_EQ(again.t, flight().frames[4 + kStateWindow - 1].t);
  ASSERT_TRUE(again.jump);
  // The position continues, but for what the frames of the window add to the start.
  EXPECT_LT(again.jump->T_before_after.t.norm(), 0.01);
  // Frame 5 shows landmarks that are not known yet: until then nothing was seen for 0.1 s.
  const double blind_m = 0.1 * pipeline.estimates()[4].nav.v_WB.norm();
  EXPECT_GT(again.jump->covariance(3, 3), blind_m * blind_m);
  EXPECT_LT(again.jump->covariance(3, 3), 4.0 * blind_m * blind_m);
  ASSERT_EQ(pipeline.estimates().size(), flight().frames.size());
  EXPECT_LT(positionError(pipeline.estimates().back()), 0.05);
  const FrameEstimate& estimate = pipeline.estimates()[4 + kStateWindow - 1];
  EXPECT_LT(angleBetween(estimate.nav.T_WB.R.row(2), flight().truth(again.t).R.row(2)),
            1e-3);  // roll and pitch are the initializer's
}

/** The flight in the order of its stamps without the samples between `first` and `last`, which is
 * longer than anything is integrated across, and with the lenses covered in frames [first, last) of
 * `covered`. */
std::unique_ptr<Pipeline> flownWithoutImu(TimeNs first, TimeNs last,
                                          std::pair<size_t, size_t> covered) {
  const Flight& flight = Flight::instance();
  PipelineOptions options;
  options.keyframes = kStateWindow;
  options.keyframe_rate_hz = kFrameRateHz;
  options.window.refine = false;
  options.input.max_gap_s = 0.15;
  PipelineInitializers initializers;
  initializers.name = "truth";
  initializers.initializer = std::make_shared<Scripted>(trueInitialization);
  auto pipeline = std::make_unique<Pipeline>(flight.calibration, options, initializers);
  auto sample = flight.imu.begin();
  for (size_t k = 0; k < flight.frames.size(); ++k) {
    StereoFrame frame = flight.frames[k];
    for (; sample != flight.imu.end() && sample->t <= frame.t; ++sample)
      if (sample->t <= first || sample->t >= last) pipeline->add(*sample);
    if (k >= covered.first && k < covered.second) {
      frame.left = cv::Mat(frame.left.size(), CV_8UC1, cv::Scalar(1.0));
      frame.right = cv::Mat(frame.right.size(), CV_8UC1, cv::Scalar(1.0));
    }
    pipeline->add(frame);
  }
  pipeline->finish();
  return pipeline;
}

/** Standard deviation of the yaw across the second start, in the last frame, rad; 0 if there was
 * none. */
double sigmaYawOfJump(const Pipeline& pipeline) {
  const Vector3d vertical_B = pipeline.estimates().back().nav.T_WB.R.row(2);
  for (const PipelineEvent& event : pipeline.events()) {
    if (!event.jump) continue;
    const Eigen::Matrix3d P = event.jump->covariance.topLeftCorner<3, 3>();
    return std::sqrt(vertical_B.dot(P * vertical_B));
  }
  return 0.0;
}

const PipelineEvent* lossOf(const Pipeline& pipeline) {
  for (const PipelineEvent& event : pipeline.events())
    if (!event.remark && event.state == PipelineState::kLost) return &event;
  return nullptr;
}

TEST_F(PipelineStates, AShortGapOfTheImuInTheDarkIsBridged) {
  const TimeNs from = flight().frames[3].t;
  const auto flown = flownWithoutImu(from, from + durationNs(0.06), {4, 5});
  EXPECT_EQ(lossOf(*flown), nullptr);
  const auto dark = std::find_if(
      flown->events().begin(), flown->events().end(),
      [](const PipelineEvent& event) { return event.state == PipelineState::kDeadReckoning; });
  ASSERT_NE(dark, flown->events().end());
  EXPECT_EQ(flown->state(), PipelineState::kInertial);
  EXPECT_LT(positionError(flown->estimates().back()), 0.1);
  EXPECT_THAT(std::next(dark)->reason, HasSubstr("and no image bridges the gap"));
}

TEST_F(PipelineStates, WithoutImagesAndImuItIsLostAndMayHaveTurned) {
  // Lost in frame 4; frame 5 is not located either, and no gyro says how it turned until then.
  const auto flown =
      flownWithoutImu(flight().frames[2].t, flight().frames[5].t - 5'000'000, {3, 5});
  const PipelineEvent* loss = lossOf(*flown);
  ASSERT_NE(loss, nullptr);
  EXPECT_EQ(loss->t, flight().frames[4].t);
  EXPECT_THAT(loss->reason, HasSubstr("neither images nor the IMU"));
  ASSERT_EQ(flown->state(), PipelineState::kInertial);
  double sigma = 0.0;  // of the pose, as far as it may have gone since
  for (const FrameEstimate& e : flown->estimates()) {
    if (e.state != PipelineState::kLost) continue;
    const double now = std::sqrt(e.pose_covariance.trace());
    EXPECT_GE(now, sigma);
    sigma = now;
  }
  EXPECT_GT(sigma, 0.01);
  // 0.5 rad/s for twice the 0.1 s of a frame before the loss and the 0.295 s of the jump after it.
  EXPECT_NEAR(sigmaYawOfJump(*flown), 0.5 * std::hypot(0.1, 0.1, 0.295), 1e-3);
}

TEST_F(PipelineStates, LostInAJumpOfTheClockItMayHaveTurnedForAsLong) {
  // Frame 4 is located without IMU; frame 5, the first one after the jump, is not.
  const auto flown =
      flownWithoutImu(flight().frames[3].t, flight().frames[5].t - 5'000'000, {5, 6});
  const PipelineEvent* loss = lossOf(*flown);
  ASSERT_NE(loss, nullptr);
  EXPECT_EQ(loss->t, flight().frames[5].t);
  ASSERT_EQ(flown->state(), PipelineState::kInertial);
  // The odometry went on by the 0.1 s of the frames before.
  EXPECT_NEAR(sigmaYawOfJump(*flown), 0.5 * std::hypot(0.1, 0.195), 1e-3);
}

TEST_F(PipelineStates, ImagesThatDoNotComeBackAfterAJumpOfTheClockAreALoss) {
  Pipeline pipeline = this->pipeline();
  const TimeNs end = flight().frames[5].t;
  ImuSample last;
  for (const ImuSample& sample : flight().imu) {
    if (sample.t > end) break;
    pipeline.add(sample);
    last = sample;
  }
  for (size_t k = 0; k <= 5; ++k) pipeline.add(flight().frames[k]);
  ASSERT_EQ(pipeline.state(), PipelineState::kInertial);
  for (int i = 0; i < 1200; ++i) {  // 6 s, from 3 s later on
    ImuSample sample = last;
    sample.t += durationNs(3.0 + 0.005 * i);
    pipeline.add(sample);
  }
  pipeline.finish();
  EXPECT_EQ(pipeline.state(), PipelineState::kLost);
  std::string said;
  for (const PipelineEvent& event : pipeline.events()) said += event.reason + "; ";
  EXPECT_THAT(said, HasSubstr("no image came for 5.0 s; neither images nor the IMU"));
}

TEST_F(PipelineStates, AJumpOfTheClockMovesNothing) {
  constexpr TimeNs kJump = 5 * kNanosecondsPerSecond;
  const TimeNs middle = flight().frames[4].t;
  const auto stamp = [middle](TimeNs t) { return t > middle ? t + kJump : t; };
  Pipeline pipeline = this->pipeline();
  auto sample = flight().imu.begin();
  for (StereoFrame frame : flight().frames) {
    for (; sample != flight().imu.end() && sample->t <= frame.t; ++sample) {
      ImuSample shifted = *sample;
      shifted.t = stamp(sample->t);
      pipeline.add(shifted);
    }
    frame.t = stamp(frame.t);
    pipeline.add(frame);
  }
  pipeline.finish();
  EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
  ASSERT_EQ(pipeline.events().size(), 3U);
  EXPECT_TRUE(pipeline.events()[2].remark);
  EXPECT_THAT(pipeline.events()[2].reason, HasSubstr("jump by 5.0"));
  EXPECT_GT(pipeline.events()[2].t, stamp(middle));
  ASSERT_EQ(pipeline.estimates().size(), flight().frames.size());
  for (size_t k = 0; k < flight().frames.size(); ++k) {
    FrameEstimate estimate = pipeline.estimates()[k];
    EXPECT_EQ(estimate.t, stamp(flight().frames[k].t));
    estimate.t = flight().frames[k].t;
    EXPECT_LT(positionError(estimate), 0.02);
  }
}

}  // namespace

}  // namespace etalon::pipeline_test
