#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/** A synchronised pair of raw (distorted) 8-bit gray images. */
struct StereoFrame {
  TimeNs t = 0;
  cv::Mat left, right;  ///< CV_8UC1; empty if the source was opened without decoding
  std::string left_path,
      right_path;  ///< files that the images came from; empty if embedded in a log
};

/** One event of a recording, in time order. */
using SensorEvent = std::variant<ImuSample, StereoFrame>;

inline TimeNs stampOf(const SensorEvent& event) {
  return std::visit([](const auto& e) { return e.t; }, event);
}

/** What was found while a recording was read. Counts grow while it is read; the unpaired and
 * those outside the IMU's time are known when it is opened. */
struct ReadStatistics {
  int stereo_frames = 0;  ///< delivered
  int imu_samples = 0;    ///< delivered
  int unpaired_left = 0;  ///< left images without a right one of the same stamp
  int unpaired_right = 0;
  int unreadable_images =
      0;                ///< pairs skipped because an image could not be decoded or has another size
  int outside_imu = 0;  ///< pairs of the range before the first or after the last IMU sample
  std::vector<std::string>
      warnings;  ///< sentences naming file and line; at most kMaxWarnings are kept

  static constexpr size_t kMaxWarnings = 20;
};

/** In the warning about a pair that was skipped: stands between the file and what is wrong. */
constexpr const char* kSkippedMark = ": skipped: ";

/** What a recording does not say itself. What its format cannot use is refused with a ConfigError. */
struct RecordingOptions {
  /** Left and right images are a pair if their stamps differ by no more, s (folders, bags); the
   * pair has the left one's stamp. */
  double pair_tolerance_s = 0.0;
  /** Kalibr's camchain.yaml and imu.yaml (folders, bags); empty: where the format looks for them. */
  std::string camchain, imu_yaml;
  /** Topics of a bag; empty: the only one that it can be. */
  std::string left_topic, right_topic, imu_topic, truth_topic;
  /** Without, the recording's own ground truth is not looked at: it may be broken. */
  bool own_truth = true;
};

struct SourceOptions {
  /** Deliver only events with from_s <= t - t_first_image <= to_s; images outside are never opened.
   */
  double from_s = 0.0;
  double to_s = 1e18;
  /** Without, StereoFrame carries stamps and paths only. */
  bool decode_images = true;
  /** Without decoding: look at the headers of the image files, and treat pairs that cannot be used
   * as if they had been decoded (skipped, counted, reported). */
  bool check_images = false;
  /** IMU samples are delivered from this long before the first delivered image, and within the
   * range until this long after the last one, s (where recorded). */
  double imu_margin_s = 0.05;
  /** Read by readGroundTruth() in place of the recording's own; empty: its own. */
  std::string ground_truth;
  RecordingOptions recording;
};

/**
 * A recording, or any other source of a stereo camera's and an IMU's measurements, in time order.
 * At equal stamps the IMU sample comes first. IMU samples are delivered from `imu_margin_s` before
 * the first delivered image at least up to the first one at or after the last delivered image (both
 * where recorded), so that every image's stamp lies inside the IMU's time.
 */
class SensorSource {
 public:
  virtual ~SensorSource() = default;

  /** What it is, for messages: the path. */
  virtual const std::string& name() const = 0;
  /** Its format in a word, for people and records: "euroc", "rawlog". */
  virtual std::string kind() const = 0;
  virtual const StereoInertialCalibration& calibration() const = 0;
  /** Empty where the recording has none. */
  virtual const GroundTruth& groundTruth() const = 0;

  /** Stamps of all paired images of the recording, whatever the options' range. */
  virtual const std::vector<TimeNs>& imageStamps() const = 0;

  /**
   * The next event, nothing at the end. A pair of images that cannot be read is skipped, counted
   * and reported in statistics(). Throws DataError if that is every pair of the range, and for input
   * that makes going on meaningless.
   */
  virtual std::optional<SensorEvent> next() = 0;

  virtual const ReadStatistics& statistics() const = 0;
};

/**
 * Opens a recording in any format that open_source.cpp lists: a EuRoC (ASL) folder (one with
 * `mav0/`, or `mav0` itself), a `.rawlog` file, or a bag of ROS 1 (`.bag`) or ROS 2 (its folder, or
 * a `.db3`).
 * @throws DataError naming file, line and what was expected
 */
std::unique_ptr<SensorSource> openSource(const std::string& path,
                                         const SourceOptions& options = {});

}  // namespace etalon
