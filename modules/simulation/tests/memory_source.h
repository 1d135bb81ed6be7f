#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "etalon/datasets/sensor_source.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon {

/** A tiny recording in memory: 4 s of images at 10 Hz and of IMU at 100 Hz, both from t = 100 s. */
class MemorySource : public SensorSource {
 public:
  static constexpr TimeNs kStart = 100 * kNanosecondsPerSecond;
  static constexpr TimeNs kFramePeriod = 100'000'000, kImuPeriod = 10'000'000;
  static constexpr int kFrames = 40, kImuSamples = 400;
  static constexpr int kWidth = 48, kHeight = 32;

  /** @param first_frame, frames the part of the images that is delivered */
  explicit MemorySource(int first_frame = 0, int frames = kFrames)
      : calibration_(eurocCalibration()) {
    truth_.has_biases = true;
    for (int i = 0; i < kFrames; ++i) stamps_.push_back(kStart + i * kFramePeriod);
    for (int i = 0; i < kImuSamples; ++i) {
      const TimeNs t = kStart + i * kImuPeriod;
      truth_.states.emplace_back(t, SE3());
      if (t >= stamps_[first_frame])
        events_.emplace_back(ImuSample{t, {0.1 * (i % 10), -0.5, 0.0}, {0.0, 0.5, 9.81}});
      const int frame = i / 10;
      if (i % 10 == 0 && first_frame <= frame && frame < first_frame + frames)
        events_.emplace_back(StereoFrame{t, image(2 * frame), image(2 * frame + 1),
                                         "l" + std::to_string(frame), "r" + std::to_string(frame)});
    }
  }

  /** A ramp that begins elsewhere in every image; its neighbours differ by 3 grey levels. */
  static cv::Mat image(int number) {
    cv::Mat result(kHeight, kWidth, CV_8UC1);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        result.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(20 + number % 40 + 3 * x);
    return result;
  }

  const std::string& name() const override { return name_; }
  std::string kind() const override { return "memory"; }
  const StereoInertialCalibration& calibration() const override { return calibration_; }
  const GroundTruth& groundTruth() const override { return truth_; }
  const std::vector<TimeNs>& imageStamps() const override { return stamps_; }
  std::optional<SensorEvent> next() override {
    if (next_ == events_.size()) return std::nullopt;
    return events_[next_++];  // images shared, as by a cache
  }
  const ReadStatistics& statistics() const override { return statistics_; }

 private:
  std::string name_ = "memory";
  StereoInertialCalibration calibration_;
  GroundTruth truth_;
  std::vector<TimeNs> stamps_;
  std::vector<SensorEvent> events_;
  ReadStatistics statistics_;
  size_t next_ = 0;
};

/** All that a source delivers, by stream. */
struct Delivered {
  std::vector<StereoFrame> frames;
  std::vector<ImuSample> imu;
  std::vector<std::pair<TimeNs, bool>> order;  ///< stamps, and whether of a frame
};

inline Delivered deliveredBy(SensorSource& source) {
  Delivered delivered;
  while (const auto event = source.next()) {
    delivered.order.emplace_back(stampOf(*event), std::holds_alternative<StereoFrame>(*event));
    if (const auto* frame = std::get_if<StereoFrame>(&*event))
      delivered.frames.push_back(*frame);
    else
      delivered.imu.push_back(std::get<ImuSample>(*event));
  }
  return delivered;
}

}  // namespace etalon
