#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CObservationImage.h>

#include <optional>
#include <string>
#include <variant>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Why an observation gave no measurement. */
struct UnusableObservation {
  enum class Kind {
    kOther,     ///< of another class or camera than ours: nothing is wrong
    kWaiting,   ///< an image whose partner may come next: nothing is wrong
    kUnpaired,  ///< an image came, but the partner of the one before it never did
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
 *    converted by others have them: two images of the same stamp are a pair; where one camera has
 *    been silent for several images of the other, these are frames of one image
 * IMU and calibration are in the body's frame; poses of sensors in the observations are not read.
 */
class ObservationInput {
 public:
  /** @param left_label and right_label of the images that come one by one
   *  @param base_folder of external images with relative paths; empty: as in toGrayImage() */
  explicit ObservationInput(std::string left_label = "cam0", std::string right_label = "cam1",
                            std::string base_folder = "")
      : labels_{std::move(left_label), std::move(right_label)},
        base_folder_(std::move(base_folder)) {}

  /** Throws nothing. */
  std::variant<SensorEvent, UnusableObservation> convert(
      const mrpt::obs::CObservation& observation);

 private:
  std::variant<SensorEvent, UnusableObservation> pair(const mrpt::obs::CObservationImage& image);

  std::array<std::string, 2> labels_;
  std::string base_folder_;
  /** The last image that has no partner yet, and whose it is. */
  struct Waiting {
    size_t camera = 0;
    TimeNs t = 0;
    cv::Mat gray;
    std::string path;
  };
  std::optional<Waiting> waiting_;
  int alone_ = 0;  ///< images in a row of its camera that had no partner
};

}  // namespace etalon
