#include "etalon/simulation/faults/faulty_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "memory_source.h"

namespace etalon {
namespace {

constexpr TimeNs kStart = MemorySource::kStart;

std::unique_ptr<SensorSource> faulted(const std::string& text, double start_s = 0.0,
                                      std::uint64_t seed = 1) {
  return withFaults(std::make_unique<MemorySource>(), parseFaultScenario("test", text), start_s,
                    seed);
}

Delivered delivered(const std::string& text, double start_s = 0.0, std::uint64_t seed = 1) {
  return deliveredBy(*faulted(text, start_s, seed));
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::equal(a.datastart, a.dataend, b.datastart);
}

int frameOf(double seconds) { return static_cast<int>(std::lround(10.0 * seconds)); }

double seconds(TimeNs t) { return secondsBetween(kStart, t); }

TEST(FaultySource, WithoutFaultsNothingChanges) {
  MemorySource source;
  const Delivered before = deliveredBy(source);
  const auto after_source = faulted("");
  const Delivered after = deliveredBy(*after_source);
  EXPECT_EQ(after.order, before.order);
  ASSERT_EQ(after.frames.size(), before.frames.size());
  for (size_t i = 0; i < after.frames.size(); ++i) {
    EXPECT_TRUE(same(after.frames[i].left, before.frames[i].left));
    EXPECT_EQ(after.frames[i].right_path, before.frames[i].right_path);
  }
  EXPECT_EQ(after_source->imageStamps(), source.imageStamps());
  EXPECT_EQ(after_source->statistics().stereo_frames, MemorySource::kFrames);
  EXPECT_EQ(after_source->statistics().imu_samples, MemorySource::kImuSamples);
  EXPECT_EQ(after_source->name(), "memory");
  EXPECT_EQ(after_source->kind(), "memory");
}

TEST(FaultySource, CoversALens) {
  const Delivered result = delivered("covered lens=left from=1 for=0.5", 0.5);
  MemorySource source;
  const Delivered plain = deliveredBy(source);
  for (size_t i = 0; i < result.frames.size(); ++i) {
    const StereoFrame& frame = result.frames[i];
    const bool covered = i >= 15 && i < 20;  // from 1.5 s on for half a second
    EXPECT_EQ(same(frame.left, plain.frames[i].left), !covered) << i;
    EXPECT_EQ(frame.left_path.empty(), covered) << i;
    EXPECT_TRUE(same(frame.right, plain.frames[i].right)) << i;
    if (!covered) continue;
    for (int level = 0; level < 5; ++level) {  // a quarter each, and none of more than 3
      const auto count = std::count(frame.left.datastart, frame.left.dataend, level);
      const double expected = level < 4 ? 0.25 * MemorySource::kWidth * MemorySource::kHeight : 0.0;
      EXPECT_NEAR(static_cast<double>(count), expected, 6.0 * std::sqrt(expected)) << level;
    }
  }
  EXPECT_FALSE(same(result.frames[15].left, result.frames[16].left));
}

TEST(FaultySource, DoesNotWriteToTheImagesOfItsSource) {
  auto source = std::make_unique<MemorySource>();
  const Delivered shared = deliveredBy(*std::make_unique<MemorySource>(*source));  // the same Mats
  const auto all = withFaults(std::move(source),
                              parseFaultScenario("all",
                                                 "blur px=2, motion_blur px=5, "
                                                 "exposure factor=2, noise gray=5, "
                                                 "covered from=2, frozen from=3"),
                              0.0, 1);
  deliveredBy(*all);
  for (int i = 0; i < MemorySource::kFrames; ++i)
    EXPECT_TRUE(same(shared.frames[i].left, MemorySource::image(2 * i))) << i;
}

TEST(FaultySource, FreezesTheLastImages) {
  const Delivered result = delivered("frozen from=1 for=0.5, noise gray=3");
  ASSERT_EQ(result.frames.size(), 40u);
  for (int i = 10; i < 15; ++i) {
    EXPECT_TRUE(same(result.frames[i].left, result.frames[9].left)) << i;
    EXPECT_TRUE(same(result.frames[i].right, result.frames[9].right)) << i;
    EXPECT_EQ(result.frames[i].t, kStart + i * MemorySource::kFramePeriod);
  }
  EXPECT_FALSE(same(result.frames[15].left, result.frames[14].left));
  EXPECT_EQ(delivered("frozen from=1 for=0.5").frames[12].left_path, "l9");

  const Delivered right = delivered("frozen lens=right from=1 for=0.5");
  for (int i = 10; i < 15; ++i) {
    EXPECT_FALSE(same(right.frames[i].left, right.frames[9].left)) << i;
    EXPECT_TRUE(same(right.frames[i].right, right.frames[9].right)) << i;
  }
  EXPECT_EQ(right.frames[12].left_path + right.frames[12].right_path, "l12r9");
}

TEST(FaultySource, DropsImages) {
  const auto source = faulted("dropped from=1 for=0.5, every n=4 from=2");
  const Delivered result = deliveredBy(*source);
  std::vector<int> numbers;
  for (const StereoFrame& frame : result.frames) numbers.push_back(frameOf(seconds(frame.t)));
  EXPECT_EQ(numbers, (std::vector<int>{0,  1,  2,  3,  4,  5,  6,  7,  8,  9,
                                       15, 16, 17, 18, 19, 20, 24, 28, 32, 36}));
  EXPECT_EQ(source->imageStamps().size(), numbers.size());
  EXPECT_EQ(source->statistics().stereo_frames, 20);
  EXPECT_EQ(result.imu.size(), static_cast<size_t>(MemorySource::kImuSamples));
}

TEST(FaultySource, LosesAShareThatTheSeedChooses) {
  const auto kept = [](std::uint64_t seed) {
    return faulted("lost percent=30", 0.0, seed)->imageStamps();
  };
  EXPECT_EQ(kept(1), kept(1));
  EXPECT_NE(kept(1), kept(2));
  size_t all = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) all += kept(seed).size();
  EXPECT_NEAR(static_cast<double>(all), 0.7 * 800.0, 4.0 * std::sqrt(800.0 * 0.21));  // 4 sigmas
}

TEST(FaultySource, GapsOfTheImu) {
  const Delivered result = delivered("imu_gap from=1 for=0.5");
  EXPECT_EQ(result.imu.size(), 350u);
  for (const ImuSample& sample : result.imu)
    EXPECT_TRUE(seconds(sample.t) < 1.0 || seconds(sample.t) >= 1.5);
  EXPECT_EQ(result.frames.size(), 40u);
}

TEST(FaultySource, SaturatesTheImu) {
  for (const ImuSample& sample : delivered("imu_limit gyro_dps=20 accel_mps2=5").imu) {
    EXPECT_LE(sample.gyro.cwiseAbs().maxCoeff(), radians(20.0));
    EXPECT_EQ(sample.gyro.y(), -radians(20.0));
    EXPECT_EQ(sample.accel, Eigen::Vector3d(0.0, 0.5, 5.0));
  }
}

TEST(FaultySource, AddsABiasToTheImuAndTheTruth) {
  const auto source = faulted("bias_jump gyro_dps=0.5 accel_mps2=0.2 from=1");
  MemorySource plain_source;
  const Delivered result = deliveredBy(*source), plain = deliveredBy(plain_source);
  for (size_t i = 0; i < result.imu.size(); ++i) {
    const Eigen::Vector3d gyro = result.imu[i].gyro - plain.imu[i].gyro;
    const Eigen::Vector3d accel = result.imu[i].accel - plain.imu[i].accel;
    const ImuBias& truth = source->groundTruth().states[i].bias;
    // Sums of doubles of up to 10, and back.
    EXPECT_NEAR(gyro.norm(), i < 100 ? 0.0 : radians(0.5), 1e-14);
    EXPECT_NEAR(accel.norm(), i < 100 ? 0.0 : 0.2, 1e-14);
    EXPECT_LT((gyro - truth.gyro).norm(), 1e-14);
    EXPECT_LT((accel - truth.accel).norm(), 1e-14);
  }
}

/** Stamps in order; at equal ones the IMU first. */
void expectInOrder(const Delivered& result) {
  EXPECT_TRUE(std::is_sorted(result.order.begin(), result.order.end()));
}

TEST(FaultySource, DelaysTheStampsOfImages) {
  for (const double ms : {25.0, -25.0}) {
    const auto source = faulted("delay ms=" + std::to_string(ms));
    const Delivered result = deliveredBy(*source);
    expectInOrder(result);
    ASSERT_EQ(result.frames.size(), 40u);
    for (int i = 0; i < 40; ++i) {
      EXPECT_EQ(result.frames[i].t,
                kStart + i * MemorySource::kFramePeriod + durationNs(1e-3 * ms));
      EXPECT_EQ(result.frames[i].t, source->imageStamps()[i]);
      EXPECT_EQ(result.frames[i].left_path, "l" + std::to_string(i));
    }
    EXPECT_EQ(result.imu.size(), 400u);
    EXPECT_EQ(result.imu.front().t, kStart);
    EXPECT_EQ(source->groundTruth().states.front().t, kStart);
  }
}

TEST(FaultySource, JitterKeepsTheOrder) {
  for (const double ms : {3.0, 200.0}) {  // the latter of two periods would swap images
    const auto source = faulted("jitter ms=" + std::to_string(ms));
    const Delivered result = deliveredBy(*source);
    expectInOrder(result);
    double squares = 0.0;
    for (int i = 0; i < 40; ++i) {
      const double off =
          secondsBetween(kStart + i * MemorySource::kFramePeriod, result.frames[i].t);
      squares += off * off;
      EXPECT_EQ(result.frames[i].t, source->imageStamps()[i]);
      if (i > 0) {
        EXPECT_GE(result.frames[i].t - result.frames[i - 1].t, 1'000'000);
      }
    }
    // The spread of a sigma from 40 numbers is 11 %: 4 of them.
    if (ms < 10.0) {
      EXPECT_NEAR(std::sqrt(squares / 40.0), 3e-3, 0.45 * 3e-3);
    }
  }
}

TEST(FaultySource, JumpsTheClockOfAll) {
  const auto source = faulted("clock_jump from=1 by=5");
  const Delivered result = deliveredBy(*source);
  expectInOrder(result);
  EXPECT_EQ(result.frames[9].t, kStart + 9 * MemorySource::kFramePeriod);
  EXPECT_EQ(result.frames[10].t, kStart + 6 * kNanosecondsPerSecond);
  EXPECT_EQ(result.imu[100].t, kStart + 6 * kNanosecondsPerSecond);
  EXPECT_EQ(source->groundTruth().states[99].t, kStart + 99 * MemorySource::kImuPeriod);
  EXPECT_EQ(source->groundTruth().states[100].t, kStart + 6 * kNanosecondsPerSecond);
  EXPECT_EQ(source->imageStamps()[10], result.frames[10].t);
}

TEST(FaultySource, ChangesTheExposure) {
  const cv::Mat image = delivered("exposure factor=2 offset=-10").frames[0].left;
  EXPECT_EQ(image.at<std::uint8_t>(0, 0), 2 * 20 - 10);
  EXPECT_EQ(image.at<std::uint8_t>(5, 7), 2 * (20 + 21) - 10);
  EXPECT_EQ(image.at<std::uint8_t>(0, 47), 255);
}

TEST(FaultySource, BlursAlongTheDirection) {
  // The ramp runs along the rows: a blur along the columns, or of a few pixels inside the image,
  // leaves it as it is; along the rows its ends are the mean with what lies behind the border.
  const cv::Mat plain = MemorySource::image(0);
  const cv::Mat down = delivered("motion_blur px=6 direction_deg=90").frames[0].left;
  EXPECT_TRUE(same(down, plain));
  for (const char* text : {"motion_blur px=6", "blur px=2"}) {
    const cv::Mat blurred = delivered(text).frames[0].left;
    EXPECT_EQ(blurred.at<std::uint8_t>(9, 24), plain.at<std::uint8_t>(9, 24)) << text;
    // A ramp of 3 a pixel behind a constant: half the mean distance, 1.5 px (0.8 px) * 3 / 2.
    EXPECT_NEAR(blurred.at<std::uint8_t>(9, 0) - plain.at<std::uint8_t>(9, 0), 2.3, 0.8) << text;
  }
}

TEST(FaultySource, AddsNoise) {
  const Delivered result = delivered("noise gray=5 lens=right");
  double squares = 0.0, sum = 0.0;
  const cv::Mat plain = MemorySource::image(1);
  const cv::Mat& image = result.frames[0].right;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double d = image.at<std::uint8_t>(y, x) - plain.at<std::uint8_t>(y, x);
      sum += d;
      squares += d * d;
    }
  const double n = static_cast<double>(image.total());
  EXPECT_NEAR(sum / n, 0.0, 4.0 * 5.0 / std::sqrt(n));
  // Rounding adds 1/12; the spread of a sigma is 1/sqrt(2 n).
  EXPECT_NEAR(std::sqrt(squares / n), std::sqrt(25.0 + 1.0 / 12.0), 4.0 * 5.0 / std::sqrt(2.0 * n));
  EXPECT_TRUE(same(result.frames[0].left, MemorySource::image(0)));
  EXPECT_TRUE(same(result.frames[3].right, delivered("noise gray=5 lens=right").frames[3].right));
  EXPECT_FALSE(
      same(result.frames[3].right, delivered("noise gray=5 lens=right", 0.0, 2).frames[3].right));
}

TEST(FaultySource, TellsAWrongCalibration) {
  const StereoInertialCalibration truth = eurocCalibration();
  const auto wrong = [&](const std::string& text) { return faulted(text)->calibration(); };
  const auto turned = [&](const StereoInertialCalibration& c, int camera) {
    return degrees(
        logSO3(truth.cameras[camera].T_BC.R.transpose() * c.cameras[camera].T_BC.R).norm());
  };
  const auto rig = wrong("calibration rotation_deg=0.5");
  EXPECT_NEAR(turned(rig, 0), 0.5, 1e-9);
  EXPECT_NEAR(turned(rig, 1), 0.5, 1e-9);
  EXPECT_LT((rig.rightFromLeft().matrix() - truth.rightFromLeft().matrix()).norm(), 1e-12);
  EXPECT_EQ(rig.cameras[0].T_BC.t, truth.cameras[0].T_BC.t);

  const auto right = wrong("calibration rotation_deg=0.5 lens=right");
  EXPECT_EQ(turned(right, 0), 0.0);
  EXPECT_NEAR(turned(right, 1), 0.5, 1e-9);
  EXPECT_EQ(right.cameras[1].T_BC.t, truth.cameras[1].T_BC.t);

  EXPECT_NEAR(wrong("calibration baseline_percent=2").baseline(), 1.02 * truth.baseline(), 1e-12);
  const auto focal = wrong("calibration focal_percent=-1 lens=left");
  EXPECT_NEAR(focal.cameras[0].model.parameter("fu"), 0.99 * truth.cameras[0].model.parameter("fu"),
              1e-9);
  EXPECT_EQ(focal.cameras[1].model, truth.cameras[1].model);
}

TEST(FaultySource, APartOfTheRecordingHasTheSameFaults) {
  const FaultScenario scenario =
      parseFaultScenario("test", "lost percent=20, noise gray=4, jitter ms=2, delay ms=-30");
  const auto whole = withFaults(std::make_unique<MemorySource>(), scenario, 1.0, 3);
  const auto part = withFaults(std::make_unique<MemorySource>(10, 20), scenario, 1.0, 3);
  EXPECT_EQ(whole->imageStamps(), part->imageStamps());
  const Delivered all = deliveredBy(*whole), some = deliveredBy(*part);
  ASSERT_FALSE(some.frames.empty());
  for (const StereoFrame& frame : some.frames) {
    const auto twin = std::find_if(all.frames.begin(), all.frames.end(),
                                   [&](const StereoFrame& other) { return other.t == frame.t; });
    ASSERT_NE(twin, all.frames.end());
    EXPECT_TRUE(same(frame.left, twin->left) && same(frame.right, twin->right));
  }
}

TEST(FaultySource, SaysWhatWasDone) {
  EXPECT_TRUE(faulted("")->statistics().warnings.empty());
  const auto source = faulted("lost percent=20", 1.5, 7);
  const std::string said =
      "memory: faults were made: lost percent=20 (times count from 1.50 s after the first image; "
      "random seed 7)";
  EXPECT_EQ(source->statistics().warnings, std::vector<std::string>{said});
  deliveredBy(*source);
  EXPECT_EQ(source->statistics().warnings, std::vector<std::string>{said});
}

TEST(FaultySource, SaysWhatLiesOutsideOfWhatWasRead) {
  const auto source = faulted("covered from=50 for=0.1, lost percent=20", 0.0, 7);
  deliveredBy(*source);
  const std::vector<std::string> said = source->statistics().warnings;
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(said[0].find("memory: faults were made: lost percent=20 ("), 0u) << said[0];
  EXPECT_NE(said[1].find("were not made: covered from=50 for=0.1 ("), std::string::npos) << said[1];
}

TEST(FaultySource, DoesNothingToImagesThatAreNotDecoded) {
  class WithoutImages : public MemorySource {
   public:
    std::optional<SensorEvent> next() override {
      std::optional<SensorEvent> event = MemorySource::next();
      if (event && std::holds_alternative<StereoFrame>(*event)) {
        std::get<StereoFrame>(*event).left.release();
        std::get<StereoFrame>(*event).right.release();
      }
      return event;
    }
  };
  const auto source = withFaults(
      std::make_unique<WithoutImages>(),
      parseFaultScenario("test", "covered, noise gray=3, frozen from=2 for=1, dropped from=3.5"),
      0.0, 1);
  const Delivered result = deliveredBy(*source);
  ASSERT_EQ(result.frames.size(), 35u);
  EXPECT_TRUE(result.frames[5].left.empty());
  EXPECT_EQ(result.frames[5].left_path, "l5");
  EXPECT_EQ(result.frames[25].right_path, "r19");
}

TEST(FaultySource, FaultsOfOneKindAddUp) {
  const auto source = faulted(
      "delay ms=10, delay ms=5 from=2, clock_jump by=1 from=1, "
      "clock_jump by=2 from=2, exposure offset=1, exposure offset=2");
  const Delivered result = deliveredBy(*source);
  expectInOrder(result);
  EXPECT_EQ(result.frames[5].t, kStart + durationNs(0.5 + 0.010));
  EXPECT_EQ(result.frames[15].t, kStart + durationNs(1.5 + 1.0 + 0.010));
  EXPECT_EQ(result.frames[25].t, kStart + durationNs(2.5 + 3.0 + 0.015));
  EXPECT_EQ(result.frames[0].left.at<std::uint8_t>(0, 0), 20 + 3);
}

TEST(FaultySource, RefusesFaultsThatLeaveNoImage) { EXPECT_THROW(faulted("dropped"), ConfigError); }

}  // namespace
}  // namespace etalon
