#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CObservationImage.h>

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Why an observation gave no measurement. */
struct UnusableObservation {
  enum class Kind {
    kOther,     ///< of another class or camera than ours: nothing is wrong
    kUnpaired,  ///< an image whose partner did not come
    kBroken,    ///< it lacks what a measurement needs
  };
  Kind kind = Kind::kOther;
  TimeNs t = 0;
  std::string reason;  ///< of what is broken, in words
};

/**
 * MRPT's observations, as sensor drivers and rawlogs deliver them, one by one as measurements:
 *  - CObservationIMU with rates and accelerations
 *  - CObservationStereoImages
 *  - CObservationImage from two cameras, told apart by the sensor label, as EuRoC recordings
 *    converted by others have them: two images of the same stamp are a pair, in whatever order they
 *    come, up to kMostWaiting late; where one camera has been silent for kSilent images of the other,
 *    these are frames of one image
 * IMU and calibration are in the body's frame; poses of sensors in the observations are not read.
 */
class ObservationInput {
 public:
  using Measurement = std::variant<SensorEvent, UnusableObservation>;

  static constexpr size_t kMostWaiting = 10;  ///< images of a camera that wait for their partners
  static constexpr int kSilent = 5;

  /** @param left_label and right_label of the images that come one by one
   *  @param base_folder of external images with relative paths; empty: as in toGrayImage() */
  explicit ObservationInput(std::string left_label = "cam0", std::string right_label = "cam1",
                            std::string base_folder = "")
      : labels_{std::move(left_label), std::move(right_label)},
        base_folder_(std::move(base_folder)) {}

  /** What can be said now, in order: nothing of an image that waits for its partner. Throws nothing.
   */
  std::vector<Measurement> convert(const mrpt::obs::CObservation& observation);

 private:
  struct Waiting {
    TimeNs t = 0;
    cv::Mat gray;
    std::string path;
  };

  std::vector<Measurement> pair(const mrpt::obs::CObservationImage& image);
  /** Images that wait and are earlier than `t`. */
  void giveUpBefore(TimeNs t, std::vector<Measurement>* all);

  std::array<std::string, 2> labels_;
  std::string base_folder_;
  std::array<std::deque<Waiting>, 2> waiting_;  ///< by camera, as they came
  std::optional<TimeNs> last_;                  ///< stamp of the last frame
  size_t camera_ = 0;                           ///< of the last image
  int in_a_row_ = 0;                            ///< images of it alone
};

}  // namespace etalon
