#include "etalon/datasets/observation_input.h"

#include <algorithm>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"

namespace etalon {

using Kind = UnusableObservation::Kind;

std::vector<ObservationInput::Measurement> ObservationInput::convert(
    const mrpt::obs::CObservation& observation) {
  const TimeNs t = fromMrptTime(observation.timestamp);
  try {
    if (const auto* imu = dynamic_cast<const mrpt::obs::CObservationIMU*>(&observation)) {
      if (const auto sample = toImuSample(*imu)) return {SensorEvent(*sample)};
      return {UnusableObservation{Kind::kBroken, t, "an IMU needs three rates and accelerations"}};
    }
    if (const auto* stereo = dynamic_cast<const mrpt::obs::CObservationStereoImages*>(&observation))
      return {SensorEvent(toStereoFrame(*stereo, base_folder_))};
    if (const auto* image = dynamic_cast<const mrpt::obs::CObservationImage*>(&observation))
      return pair(*image);
  } catch (const std::exception& e) {  // an image that is none, or cannot be read
    return {UnusableObservation{Kind::kBroken, t, e.what()}};
  }
  return {UnusableObservation{Kind::kOther, t, ""}};
}

std::vector<ObservationInput::Measurement> ObservationInput::pair(
    const mrpt::obs::CObservationImage& image) {
  const TimeNs t = fromMrptTime(image.timestamp);
  const size_t camera = image.sensorLabel == labels_[0] ? 0 : 1;
  if (image.sensorLabel != labels_[camera]) return {UnusableObservation{Kind::kOther, t, ""}};
  Waiting now{t, {}, ""};
  now.gray = toGrayImage(image.image, base_folder_, &now.path,
                         "image observation '" + image.sensorLabel + "'");
  in_a_row_ = camera == camera_ ? in_a_row_ + 1 : 1;
  camera_ = camera;

  std::vector<Measurement> all;
  std::deque<Waiting>&mine = waiting_[camera], &others = waiting_[1 - camera];
  const auto of_this_stamp = [t](const Waiting& waiting) { return waiting.t == t; };
  const auto partner = std::find_if(others.begin(), others.end(), of_this_stamp);
  if (partner != others.end()) {
    const Waiting& left = camera == 0 ? now : *partner;
    const Waiting& right = camera == 0 ? *partner : now;
    StereoFrame frame{t, left.gray, right.gray, left.path, right.path};
    others.erase(partner);
    giveUpBefore(t, &all);
    all.emplace_back(SensorEvent(std::move(frame)));
    last_ = t;
    return all;
  }
  const bool is_late = last_ && t <= *last_ && in_a_row_ <= kSilent;
  if (is_late || std::any_of(mine.begin(), mine.end(), of_this_stamp))
    return {UnusableObservation{Kind::kUnpaired, t, ""}};
  now.gray = now.gray.clone();  // the driver may use its buffer again
  mine.push_back(std::move(now));
  if (in_a_row_ > kSilent) {
    for (; mine.size() > 1; mine.pop_front()) {
      const Waiting& alone = mine.front();
      StereoFrame frame{alone.t, {}, {}, "", ""};
      (camera == 0 ? frame.left : frame.right) = alone.gray;
      (camera == 0 ? frame.left_path : frame.right_path) = alone.path;
      all.emplace_back(SensorEvent(std::move(frame)));
      last_ = alone.t;
    }
    giveUpBefore(*last_, &all);
  } else if (mine.size() > kMostWaiting) {
    all.emplace_back(UnusableObservation{Kind::kUnpaired, mine.front().t, ""});
    mine.pop_front();
  }
  return all;
}

void ObservationInput::giveUpBefore(TimeNs t, std::vector<Measurement>* all) {
  for (std::deque<Waiting>& waiting : waiting_) {
    const auto is_early = [t](const Waiting& w) { return w.t < t; };
    for (const Waiting& w : waiting)
      if (is_early(w)) all->emplace_back(UnusableObservation{Kind::kUnpaired, w.t, ""});
    waiting.erase(std::remove_if(waiting.begin(), waiting.end(), is_early), waiting.end());
  }
}

}  // namespace etalon
