#include "etalon/datasets/observation_input.h"

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"

namespace etalon {

using Kind = UnusableObservation::Kind;

/** Images in a row without one of the other camera, after which that is silent. */
static constexpr int kSilent = 5;

std::variant<SensorEvent, UnusableObservation> ObservationInput::convert(
    const mrpt::obs::CObservation& observation) {
  const TimeNs t = fromMrptTime(observation.timestamp);
  try {
    if (const auto* imu = dynamic_cast<const mrpt::obs::CObservationIMU*>(&observation)) {
      if (const auto sample = toImuSample(*imu)) return SensorEvent(*sample);
      return UnusableObservation{Kind::kBroken, t, "an IMU needs three rates and accelerations"};
    }
    if (const auto* stereo = dynamic_cast<const mrpt::obs::CObservationStereoImages*>(&observation))
      return SensorEvent(toStereoFrame(*stereo, base_folder_));
    if (const auto* image = dynamic_cast<const mrpt::obs::CObservationImage*>(&observation))
      return pair(*image);
  } catch (const std::exception& e) {  // an image that is none, or cannot be read
    return UnusableObservation{Kind::kBroken, t, e.what()};
  }
  return UnusableObservation{Kind::kOther, t, ""};
}

std::variant<SensorEvent, UnusableObservation> ObservationInput::pair(
    const mrpt::obs::CObservationImage& image) {
  const TimeNs t = fromMrptTime(image.timestamp);
  const size_t camera = image.sensorLabel == labels_[0] ? 0 : 1;
  if (image.sensorLabel != labels_[camera]) return UnusableObservation{Kind::kOther, t, ""};
  Waiting now{camera, t, {}, ""};
  now.gray = toGrayImage(image.image, base_folder_, &now.path,
                         "image observation '" + image.sensorLabel + "'");
  const std::optional<Waiting> before = std::move(waiting_);
  waiting_.reset();
  if (before && before->camera != camera && before->t == t) {
    const Waiting& left = camera == 0 ? now : *before;
    const Waiting& right = camera == 0 ? *before : now;
    return SensorEvent(StereoFrame{t, left.gray, right.gray, left.path, right.path});
  }
  now.gray = now.gray.clone();  // the driver may use its buffer again
  waiting_ = std::move(now);
  alone_ = before && before->camera == camera ? alone_ + 1 : 0;
  if (alone_ >= kSilent) {
    StereoFrame frame{before->t, {}, {}, "", ""};
    (camera == 0 ? frame.left : frame.right) = before->gray;
    (camera == 0 ? frame.left_path : frame.right_path) = before->path;
    return SensorEvent(std::move(frame));
  }
  if (before) return UnusableObservation{Kind::kUnpaired, before->t, ""};
  return UnusableObservation{Kind::kWaiting, t, ""};
}

}  // namespace etalon
