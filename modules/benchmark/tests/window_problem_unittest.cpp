// A window that is cut out of a recording's tracks: which frames, keyframes and samples it has.

#include <gtest/gtest.h>

#include "etalon/benchmark/windows.h"

namespace etalon {
namespace {

constexpr TimeNs kFrameStep = 50'000'000, kSampleStep = 5'000'000;

/** Ten seconds at 20 Hz from `first` on, with the IMU from a second before to a second after. */
SequenceTracks tracksFrom(TimeNs first) {
  SequenceTracks tracks;
  tracks.first_image = first;
  for (int k = 0; k <= 200; ++k) {
    TrackedFrame frame;
    frame.t = first + kFrameStep * k;
    Observation o;
    o.id = k;
    frame.observations.push_back(o);
    tracks.frames.push_back(frame);
  }
  std::vector<ImuSample> samples;
  for (TimeNs t = first - kNanosecondsPerSecond; t <= first + 11 * kNanosecondsPerSecond;
       t += kSampleStep)
    samples.push_back({t, Eigen::Vector3d::Constant(1e-9 * static_cast<double>(t - first)),
                       Eigen::Vector3d::Zero()});
  tracks.imu = ImuBuffer(samples);
  return tracks;
}

InitializationProblem cut(const SequenceTracks& tracks, int window, const WindowShape& shape,
                          const ImuNoiseOptions& noise = {}) {
  return windowProblem(tracks, 2.5, shape, window, noise, {});
}

TEST(WindowProblem, BeginsAtItsMultipleAndHasEveryFrameInBetween) {
  const TimeNs first = 1'403'636'584'763'555'584;
  const InitializationProblem problem = cut(tracksFrom(first), 2, {10, 4.0});
  ASSERT_EQ(problem.keyframeCount(), 10);
  EXPECT_EQ(problem.keyframe(0).t, first + 100 * kFrameStep);  // 5 s
  for (int k = 0; k < 10; ++k) {
    EXPECT_EQ(problem.keyframe(k).t, first + (100 + 5 * k) * kFrameStep);
    EXPECT_EQ(problem.keyframe(k).observations[0].id, 100 + 5 * k);
  }
  EXPECT_EQ(problem.frames().size(), 46U);
  EXPECT_EQ(problem.frames().back().t, problem.keyframe(9).t);  // none behind the last keyframe
  // The samples reach exactly from the first to the last keyframe.
  EXPECT_EQ(problem.imu().samples().front().t, problem.keyframe(0).t);
  EXPECT_EQ(problem.imu().samples().back().t, problem.keyframe(9).t);
  EXPECT_EQ(problem.imu().samples().size(), 9U * 50U + 1U);
}

TEST(WindowProblem, AStampsJitterMovesNoWindow) {
  // The first frame of window 1 comes a millisecond early; two are more than jitter.
  for (const double early_ms : {0.0, 1.0, 1.9, 2.1}) {
    SequenceTracks tracks = tracksFrom(0);
    tracks.frames[50].t -= durationNs(1e-3 * early_ms);
    EXPECT_EQ(cut(tracks, 1, {10, 4.0}).keyframe(0).observations[0].id, early_ms < 2.0 ? 50 : 51);
  }
  // A window at the beginning does not look for frames before the recording.
  EXPECT_EQ(cut(tracksFrom(0), 0, {10, 4.0}).keyframe(0).t, 0);
}

TEST(WindowProblem, AWindowCountsFromTheFirstImageWhetherItCouldBeReadOrNot) {
  SequenceTracks tracks = tracksFrom(0);
  tracks.frames.erase(tracks.frames.begin(), tracks.frames.begin() + 3);
  EXPECT_EQ(cut(tracks, 0, {10, 4.0}).keyframe(0).t, 3 * kFrameStep);
  EXPECT_EQ(cut(tracks, 1, {10, 4.0}).keyframe(0).t, 50 * kFrameStep);
}

TEST(WindowProblem, AtTheEndItHasFewerKeyframesAndBeyondItNone) {
  const SequenceTracks tracks = tracksFrom(0);
  const InitializationProblem last = cut(tracks, 3, {20, 4.0});  // 7.5 s to 10 s
  EXPECT_EQ(last.keyframeCount(), 11);
  EXPECT_EQ(last.imu().samples().back().t, 200 * kFrameStep);
  const InitializationProblem one = cut(tracks, 4, {10, 4.0});
  EXPECT_EQ(one.keyframeCount(), 1);
  EXPECT_TRUE(one.imu().empty());
  const InitializationProblem none = cut(tracks, 5, {10, 4.0});
  EXPECT_EQ(none.keyframeCount(), 0);
  EXPECT_TRUE(none.frames().empty());
}

TEST(WindowProblem, WindowsThatBeginInAGapOfTheImagesAreNotTheOneBehindIt) {
  SequenceTracks tracks = tracksFrom(0);
  auto& frames = tracks.frames;
  frames.erase(frames.begin() + 40, frames.begin() + 112);  // 2.0 s to 5.6 s
  EXPECT_EQ(cut(tracks, 1, {10, 4.0}).keyframeCount(), 0);
  EXPECT_EQ(cut(tracks, 2, {10, 4.0}).keyframeCount(), 0);
  frames.insert(frames.begin() + 40, tracksFrom(0).frames[104]);  // 5.2 s
  EXPECT_EQ(cut(tracks, 1, {10, 4.0}).keyframeCount(), 0);
  EXPECT_EQ(cut(tracks, 2, {10, 4.0}).keyframe(0).observations[0].id, 104);
}

TEST(WindowProblem, WithoutTheImusSamplesItHasNone) {
  SequenceTracks tracks = tracksFrom(0);
  std::vector<ImuSample> samples = tracks.imu.samples();
  samples.resize(samples.size() - 400);  // the last second of images has none
  tracks.imu = ImuBuffer(samples);
  EXPECT_FALSE(cut(tracks, 2, {10, 4.0}).imu().empty());
  EXPECT_TRUE(cut(tracks, 3, {10, 4.0}).imu().empty());
  EXPECT_EQ(cut(tracks, 3, {10, 4.0}).keyframeCount(), 10);
}

TEST(WindowProblem, TheRateAndTheNoiseAreThoseThatAreAskedFor) {
  const SequenceTracks tracks = tracksFrom(0);
  const InitializationProblem fast = cut(tracks, 0, {5, 10.0});
  EXPECT_EQ(fast.keyframeCount(), 5);
  EXPECT_EQ(fast.keyframe(4).t, 8 * kFrameStep);
  ImuNoiseOptions noise;
  noise.gyro_noise_factor = noise.min_gyro_noise_factor = 3.0;
  const double density = tracks.calibration.imu.noise.gyro_noise_density;
  EXPECT_DOUBLE_EQ(cut(tracks, 0, {5, 10.0}, noise).imuNoise().gyro_noise_density, 3.0 * density);
}

}  // namespace
}  // namespace etalon
