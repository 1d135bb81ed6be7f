#include "etalon/frontend/repeated_images.h"

#include <algorithm>

#include "etalon/core/statistics.h"
#include "etalon/frontend/image_content.h"
#include "etalon/imu/mean_sample.h"

namespace etalon {

namespace {

/** Tracks of a platform at rest move by less than 0.2 px in real images (noise of the tracker);
 * 0.5 px a frame are 0.02 rad/s or, 3 m away, 0.07 m/s at 20 Hz. */
constexpr double kMovedPx = 0.5;
/** Means over the interval of a frame. White noise of a MEMS sensor has 0.001 rad/s and 0.01 m/s^2
 * there, its bias cancels in the difference. */
constexpr double kTurnedRps = 0.05;
constexpr double kPushedMps2 = 0.5;

bool showsTheSame(const cv::Mat& now, const cv::Mat& before) {
  return !now.empty() && samePixels(now, before) && !withoutContrast(now);
}

}  // namespace

bool RepeatedImages::contradicts(const std::optional<ImuSample>& mean, const Camera& camera) const {
  if (flow_px_ > kMovedPx) return true;
  return mean && camera.reference &&
         ((mean->gyro - camera.reference->gyro).norm() > kTurnedRps ||
          (mean->accel - camera.reference->accel).norm() > kPushedMps2);
}

std::array<bool, 2> RepeatedImages::areRepeated(const cv::Mat& left, const cv::Mat& right,
                                                const std::vector<ImuSample>& imu) {
  std::optional<ImuSample> mean;
  if (!imu.empty()) mean = meanSample(imu);
  all_new_ = true;
  const std::array<const cv::Mat*, 2> images{&left, &right};
  for (size_t c = 0; c < 2; ++c) {
    Camera& camera = cameras_[c];
    const bool is_new = !showsTheSame(*images[c], camera.previous);
    images[c]->copyTo(camera.previous);
    if (is_new || !camera.reference) camera.reference = mean;
    camera.contradicted = !is_new && (camera.contradicted || contradicts(mean, camera));
    all_new_ = all_new_ && is_new;
  }
  return {cameras_[0].contradicted, cameras_[1].contradicted};
}

void RepeatedImages::tracked(const TrackedFrame& frame) {
  std::vector<double> flows;
  std::map<LandmarkId, Eigen::Vector2d> pixels;
  for (const Observation& o : frame.observations) {
    pixels[o.id] = o.left;
    const auto before = pixels_.find(o.id);
    if (before != pixels_.end()) flows.push_back((o.left - before->second).norm());
  }
  pixels_ = std::move(pixels);
  // What a repeated image shows says nothing of the motion.
  if (!all_new_) return;
  flow_px_ = flows.empty() ? 0.0 : median(std::move(flows));
}

}  // namespace etalon
