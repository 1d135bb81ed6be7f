// The pipeline as a library: MRPT observations from any thread, states at IMU rate, live threads.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CObservationComment.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/pipeline/pipeline.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {

namespace {

constexpr size_t kWindow = 3;  // keyframes

class PipelineLive : public ::testing::Test {
 protected:
  static const Flight& flight() { return Flight::instance(); }

  static Pipeline pipeline(bool live, size_t history_frames = 0) {
    PipelineOptions options;
    options.keyframes = kWindow;
    options.keyframe_rate_hz = kFrameRateHz;
    options.window.refine = false;  // what the script says counts as it is
    options.live = live;
    options.history_frames = history_frames;
    PipelineInitializers initializers;
    initializers.name = "truth";
    initializers.initializer = std::make_shared<Scripted>(trueInitialization);
    return {flight().calibration, options, initializers};
  }

  /** Samples up to `t`, from *next on. */
  static void addImu(TimeNs t, size_t* next, Pipeline* pipeline) {
    for (; *next < flight().imu.size() && flight().imu[*next].t <= t; ++*next)
      pipeline->process(toObservation(flight().imu[*next]));
  }
};

TEST_F(PipelineLive, ObservationsAreTheSameAsMeasurements) {
  Pipeline measured = pipeline(false), observed = pipeline(false), by_images = pipeline(false);
  for (const ImuSample& sample : flight().imu) {
    ImuSample cut = sample;
    cut.t = truncateToMrptTick(sample.t);
    measured.add(cut);
    observed.process(toObservation(sample));
    by_images.process(toObservation(sample));
  }
  for (StereoFrame frame : flight().frames) {
    frame.t = truncateToMrptTick(frame.t);
    measured.add(frame);
    const auto stereo = toObservation(frame, flight().calibration);
    observed.process(stereo);
    mrpt::obs::CObservationImage image;
    image.timestamp = stereo.timestamp;
    image.sensorLabel = "cam1";
    image.image = stereo.imageRight;
    by_images.process(image);
    image.sensorLabel = "cam0";
    image.image = stereo.imageLeft;
    by_images.process(image);
  }
  for (Pipeline* pipeline : {&measured, &observed, &by_images}) pipeline->finish();
  ASSERT_EQ(observed.trajectory().size(), flight().frames.size());
  for (size_t k = 0; k < measured.trajectory().size(); ++k)
    for (const Pipeline* other : {&observed, &by_images}) {
      EXPECT_EQ(other->trajectory()[k].t, measured.trajectory()[k].t);
      EXPECT_EQ(other->trajectory()[k].T_WB.t, measured.trajectory()[k].T_WB.t);
    }
  EXPECT_TRUE(by_images.inputFaults().empty());
}

TEST_F(PipelineLive, WhatIsBrokenIsCountedAndWhatIsUnknownIgnored) {
  Pipeline pipeline = this->pipeline(false);
  mrpt::obs::CObservationIMU imu;
  imu.timestamp = toMrptTime(flight().imu[0].t);
  pipeline.process(imu);  // no rates
  mrpt::obs::CObservationImage image;
  image.timestamp = imu.timestamp;
  image.sensorLabel = "cam0";
  pipeline.process(image);  // empty
  image.image = mrpt::img::CImage(cv::Mat(480, 752, CV_8UC1, cv::Scalar(7)), mrpt::img::DEEP_COPY);
  for (int k = 0; k < 3; ++k) {
    image.timestamp = toMrptTime(flight().frames[k].t);
    pipeline.process(image);
  }
  // The right camera has the last one alone, and of another size.
  image.sensorLabel = "cam1";
  image.image = mrpt::img::CImage(cv::Mat(48, 64, CV_8UC1, cv::Scalar(7)), mrpt::img::DEEP_COPY);
  pipeline.process(image);
  image.sensorLabel = "thermal";
  pipeline.process(image);
  pipeline.process(mrpt::obs::CObservationComment());
  pipeline.finish();
  const InputFaultCounts faults = pipeline.inputFaults();
  EXPECT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults.at(InputFault::kObservationBroken).count, 2);
  EXPECT_EQ(faults.at(InputFault::kImageUnpaired).count, 2);
  EXPECT_EQ(faults.at(InputFault::kFrameUnusable).count, 1);
  EXPECT_TRUE(pipeline.trajectory().empty());
}

TEST_F(PipelineLive, TheImuCarriesTheStateBetweenFrames) {
  Pipeline pipeline = this->pipeline(false);
  std::vector<ImuRateState> states;
  pipeline.onImuState([&states](const ImuRateState& state) { states.push_back(state); });
  EXPECT_FALSE(pipeline.latest());
  size_t next = 0;
  for (const StereoFrame& frame : flight().frames) {
    addImu(frame.t, &next, &pipeline);
    pipeline.process(toObservation(frame, flight().calibration));
  }
  const TimeNs last = flight().frames.back().t;
  EXPECT_FALSE(pipeline.stateAt(last - durationNs(0.2)));  // in the past
  addImu(last + durationNs(2.0), &next, &pipeline);
  ASSERT_FALSE(states.empty());
  TimeNs before = 0;
  for (const ImuRateState& state : states) {
    EXPECT_GT(state.t, before);
    before = state.t;
    const auto truth = flight().trajectory.at(state.t);
    // What the frames' estimates are off by, and an IMU without noise.
    if (state.t > last) continue;
    EXPECT_LT((state.nav.T_WB.t - truth.T_WB.t).norm(), 0.02);
    EXPECT_LT((state.nav.v_WB - truth.v_WB).norm(), 0.05);
  }
  // From the first frame after the start on, one a sample.
  EXPECT_GT(states.size(), static_cast<size_t>(200.0 / kFrameRateHz * (kFrames - kWindow)));
  const auto latest = pipeline.latest();
  ASSERT_TRUE(latest);
  EXPECT_EQ(latest->t, truncateToMrptTick(last));
  const auto now = pipeline.stateAt(states.back().t);
  ASSERT_TRUE(now);
  EXPECT_EQ(now->nav.T_WB.t, states.back().nav.T_WB.t);
  // However late the last frame was processed.
  EXPECT_EQ(now->state, PipelineState::kInertial);
  EXPECT_FALSE(pipeline.stateAt(states.back().t + durationNs(0.1)));  // not known yet
}

TEST_F(PipelineLive, ThreadsShareTheBorderAndLateFramesAreCounted) {
  Pipeline pipeline = this->pipeline(true);
  std::atomic<size_t> frames{0};
  pipeline.onFrame([&frames](const FrameEstimate&) { ++frames; });
  std::thread imu([&pipeline] {
    for (const ImuSample& sample : flight().imu) pipeline.process(toObservation(sample));
  });
  std::thread camera([&pipeline] {
    for (const StereoFrame& frame : flight().frames) {
      // The driver's buffers are used again at once.
      StereoFrame copy{frame.t, frame.left.clone(), frame.right.clone(), "", ""};
      pipeline.add(copy);
      copy.left.setTo(0);
      copy.right.setTo(0);
    }
  });
  std::thread reader([&pipeline, &frames] {
    while (frames < 1) std::this_thread::yield();
    EXPECT_TRUE(pipeline.latest());
    pipeline.stateAt(flight().frames.back().t);
    pipeline.inputFaults();
  });
  imu.join();
  camera.join();
  pipeline.finish();
  reader.join();
  const InputFaultCounts faults = pipeline.inputFaults();
  const auto late = faults.find(InputFault::kFrameLate);
  const size_t dropped = late == faults.end() ? 0 : static_cast<size_t>(late->second.count);
  // Every frame is either there or said to be dropped, and the last one is never dropped.
  EXPECT_EQ(pipeline.estimates().size() + dropped, flight().frames.size());
  EXPECT_EQ(frames, pipeline.estimates().size());
  EXPECT_EQ(pipeline.estimates().back().t, flight().frames.back().t);
}

TEST_F(PipelineLive, WhatAThreadThrowsReachesTheCaller) {
  Pipeline pipeline = this->pipeline(true);
  pipeline.onFrame([](const FrameEstimate&) { throw std::runtime_error("out of order"); });
  const auto addAll = [&pipeline] {
    for (;;)  // until it has been thrown
      for (const ImuSample& sample : flight().imu) pipeline.add(sample);
  };
  pipeline.add(flight().frames[0]);
  EXPECT_THAT(addAll, ::testing::ThrowsMessage<std::runtime_error>("out of order"));
  EXPECT_THAT([&] { pipeline.add(flight().frames[1]); },
              ::testing::ThrowsMessage<std::runtime_error>("out of order"));
  EXPECT_THAT([&] { pipeline.finish(); },
              ::testing::ThrowsMessage<std::runtime_error>("out of order"));
  EXPECT_EQ(pipeline.estimates().size(), 1U);
}

TEST_F(PipelineLive, AHistoryWithoutEndIsCut) {
  Pipeline pipeline = this->pipeline(false, 2);
  for (const ImuSample& sample : flight().imu) pipeline.add(sample);
  for (const StereoFrame& frame : flight().frames) pipeline.add(frame);
  pipeline.finish();
  EXPECT_GE(pipeline.estimates().size(), 2U);
  EXPECT_LT(pipeline.estimates().size(), 4U);
  EXPECT_EQ(pipeline.trajectory().size(), pipeline.estimates().size());
  EXPECT_EQ(pipeline.trajectory().back().t, flight().frames.back().t);
  EXPECT_EQ(pipeline.smoothedTrajectory().size(), pipeline.trajectory().size());
}

/** The flight, and the IMU alone for longer. */
void flyAndGoOn(double seconds, Pipeline* pipeline) {
  const Flight& flight = Flight::instance();
  for (const ImuSample& sample : flight.imu) pipeline->add(sample);
  for (const StereoFrame& frame : flight.frames) pipeline->add(frame);
  ImuSample still = flight.imu.back();
  for (int k = 0; k < 200 * seconds; ++k) {
    still.t += durationNs(0.005);
    pipeline->add(still);
  }
  pipeline->finish();
}

TEST_F(PipelineLive, ImagesThatStopAreSaid) {
  Pipeline pipeline = this->pipeline(false);
  flyAndGoOn(2.5, &pipeline);
  EXPECT_EQ(pipeline.state(), PipelineState::kDeadReckoning);
  EXPECT_THAT(pipeline.events().back().reason, ::testing::HasSubstr("no image came for"));
  EXPECT_EQ(pipeline.events().back().t,
            flight().frames.back().t + durationNs(noImageS(kFrameRateHz)));
}

TEST_F(PipelineLive, DeadReckoningEndsThoughNoImageComes) {
  Pipeline pipeline = this->pipeline(false);
  std::optional<TimeNs> last_state;
  pipeline.onImuState([&](const ImuRateState& state) { last_state = state.t; });
  flyAndGoOn(25.0, &pipeline);
  EXPECT_EQ(pipeline.state(), PipelineState::kLost);
  const TimeNs last = flight().frames.back().t;
  EXPECT_NEAR(secondsBetween(last, pipeline.events().back().t), 20.0, 0.01);
  EXPECT_THAT(pipeline.events().back().reason,
              ::testing::HasSubstr("no image has located the platform for 20.0 s"));
  ASSERT_TRUE(last_state);
  EXPECT_NEAR(secondsBetween(last, *last_state), 20.1, 0.02);
  EXPECT_FALSE(pipeline.stateAt(last + durationNs(21.0)));
  EXPECT_EQ(pipeline.estimates().back().t, last);  // no frame, no pose
}

TEST_F(PipelineLive, TheLastImageOfARecordingIsNoFault) {
  Pipeline pipeline = this->pipeline(false);
  flyAndGoOn(1.5, &pipeline);
  EXPECT_EQ(pipeline.state(), PipelineState::kInertial);
  EXPECT_EQ(pipeline.events().size(), 2U);
}

TEST_F(PipelineLive, TracksComeWithTheirImages) {
  Pipeline pipeline = this->pipeline(false);
  std::vector<TimeNs> stamps;
  pipeline.onTracks([&stamps](const FrontFrame& frame) {
    stamps.push_back(frame.t);
    EXPECT_EQ(frame.images.t, frame.t);
    EXPECT_FALSE(frame.images.left.empty());
    ASSERT_TRUE(frame.tracked);
    EXPECT_FALSE(frame.tracked->observations.empty());
  });
  flyAndGoOn(0.1, &pipeline);
  ASSERT_EQ(stamps.size(), flight().frames.size());
  for (size_t i = 0; i < stamps.size(); ++i) EXPECT_EQ(stamps[i], flight().frames[i].t);
}

TEST_F(PipelineLive, LiveImagesThatStopAreSaidAtOnce) {
  Pipeline pipeline = this->pipeline(true);
  std::atomic<TimeNs> last{0};
  pipeline.onFrame([&](const FrameEstimate& estimate) { last = estimate.t; });
  auto sample = flight().imu.begin();
  for (const StereoFrame& frame : flight().frames) {
    for (; sample != flight().imu.end() && sample->t <= frame.t; ++sample) pipeline.add(*sample);
    pipeline.add(frame);
    while (last < frame.t) std::this_thread::yield();
  }
  ImuSample still = *std::prev(sample);
  for (int k = 0; k < 150; ++k) {  // 0.75 s: less than what ends a recording
    still.t += durationNs(0.005);
    pipeline.add(still);
  }
  pipeline.finish();
  EXPECT_EQ(pipeline.state(), PipelineState::kDeadReckoning);
  EXPECT_EQ(pipeline.events().back().t,
            flight().frames.back().t + durationNs(noImageS(kFrameRateHz)));
}

TEST_F(PipelineLive, AnImuThatEndsIsSaidAndTheImagesGoOn) {
  Pipeline pipeline = this->pipeline(false);
  const TimeNs end = flight().frames[kWindow].t;
  for (const ImuSample& sample : flight().imu)
    if (sample.t <= end) pipeline.add(sample);
  for (const StereoFrame& frame : flight().frames) pipeline.add(frame);
  pipeline.finish();
  ASSERT_EQ(pipeline.estimates().size(), flight().frames.size());
  const InputFaultCounts faults = pipeline.inputFaults();
  EXPECT_EQ(faults.at(InputFault::kFrameWithoutImu).count, static_cast<int>(kFrames - kWindow - 1));
  ASSERT_EQ(pipeline.events().size(), 4U);
  EXPECT_THAT(pipeline.events()[2].reason, ::testing::HasSubstr("no IMU"));
  EXPECT_TRUE(pipeline.events()[2].remark);
  EXPECT_EQ(pipeline.events()[2].t, flight().frames[kWindow + 1].t);
  EXPECT_EQ(pipeline.events()[2].state, PipelineState::kInertial);
  for (const FrameEstimate& estimate : pipeline.estimates())
    EXPECT_LT((estimate.nav.T_WB.t - flight().truth(estimate.t).t).norm(), 0.05);
}

TEST_F(PipelineLive, WithoutAnyImuStereoOdometryRunsAndItIsSaid) {
  Pipeline pipeline = this->pipeline(false);
  for (const StereoFrame& frame : flight().frames) pipeline.add(frame);
  pipeline.finish();
  EXPECT_EQ(pipeline.estimates().size(), flight().frames.size());
  EXPECT_EQ(pipeline.state(), PipelineState::kVisual);
  EXPECT_EQ(pipeline.inputFaults().at(InputFault::kFrameWithoutImu).count, kFrames);
}

}  // namespace

}  // namespace etalon::pipeline_test
