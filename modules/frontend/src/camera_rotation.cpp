#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "etalon/core/so3.h"
#include "etalon/frontend/time_offset.h"
#include "motion_check.h"

namespace etalon {

namespace {

constexpr int kMaxCorners = 200;
constexpr size_t kMinTracks = 25;
constexpr size_t kBlockFrames = 40;

/** Follows corners from image to image and measures the rotation between the last two. */
class RotationTracker {
 public:
  explicit RotationTracker(const CameraModel& camera) : camera_(camera) {}

  /** Log(R_C0C1) from the previous image to this one; nothing for the first one or with too few
   * tracks. */
  std::optional<Eigen::Vector3d> add(const cv::Mat& image) {
    std::optional<Eigen::Vector3d> rotation;
    std::vector<cv::Point2f> next;
    if (!corners_.empty()) {
      next = track(image);
      rotation = rotationTo(next);
    }
    image_ = image;
    corners_ = std::move(next);
    // New corners when half of them are lost; the old ones go, which keeps the spread even.
    if (corners_.size() < kMaxCorners / 2)
      cv::goodFeaturesToTrack(image_, corners_, kMaxCorners, 0.01, 15);
    return rotation;
  }

 private:
  /** Where the corners are in `image`; corners_ keeps those that were found, in the same order. */
  std::vector<cv::Point2f> track(const cv::Mat& image) {
    std::vector<cv::Point2f> next;
    std::vector<unsigned char> found;
    cv::calcOpticalFlowPyrLK(image_, image, corners_, next, found, cv::noArray(), {21, 21}, 3);
    size_t kept = 0;
    for (size_t i = 0; i < next.size(); ++i) {
      if (!found[i] || !camera_.inImage({next[i].x, next[i].y}, 2.0)) continue;
      next[kept] = next[i];
      corners_[kept++] = corners_[i];
    }
    next.resize(kept);
    corners_.resize(kept);
    return next;
  }

  /** (x/z, y/z), if the pixel's ray meetsPlane(). */
  std::optional<cv::Point2d> onPlane(const cv::Point2f& pixel) const {
    const auto ray = camera_.unproject({pixel.x, pixel.y});
    if (!ray || !meetsPlane(*ray)) return std::nullopt;
    return cv::Point2d(ray->x() / ray->z(), ray->y() / ray->z());
  }

  std::optional<Eigen::Vector3d> rotationTo(const std::vector<cv::Point2f>& next) const {
    std::vector<cv::Point2d> a, b;
    for (size_t i = 0; i < next.size(); ++i) {
      const auto p = onPlane(corners_[i]), q = onPlane(next[i]);
      if (!p || !q) continue;
      a.push_back(*p);
      b.push_back(*q);
    }
    if (a.size() < kMinTracks) return std::nullopt;
    const cv::Mat E = cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, 0.99,
                                           1.0 / camera_.focal().x());
    if (E.rows != 3) return std::nullopt;
    // E is that of R_C1C0. Of the two rotations that it allows, the other one is turned by 180
    // degrees.
    cv::Mat R1, R2, t;
    cv::decomposeEssentialMat(E, R1, R2, t);
    const auto inverseLog = [](const cv::Mat& R) {
      return logSO3(Eigen::Map<const Eigen::Matrix3d>(R.ptr<double>()));  // row-major: R^T
    };
    const Eigen::Vector3d first = inverseLog(R1), second = inverseLog(R2);
    return first.norm() < second.norm() ? first : second;
  }

  const CameraModel& camera_;
  cv::Mat image_;
  std::vector<cv::Point2f> corners_;
};

/** Standard deviation of the gyro's rate over the images [first, first + count). */
double gyroSpread(const std::vector<ImuSample>& imu, const std::vector<TimeNs>& stamps,
                  size_t first, size_t count) {
  auto sample = std::lower_bound(imu.begin(), imu.end(), stamps[first],
                                 [](const ImuSample& s, TimeNs t) { return s.t < t; });
  double n = 0, sum = 0, squares = 0;
  for (; sample != imu.end() && sample->t <= stamps[first + count - 1]; ++sample) {
    const double rate = sample->gyro.norm();
    n += 1, sum += rate, squares += rate * rate;
  }
  return n > 0 ? std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) : 0.0;
}

/** First images of the blocks to look at, in the order of time. */
std::vector<size_t> chooseBlocks(const RecordedSource& source, size_t block, size_t count) {
  const std::vector<TimeNs>& stamps = source.imageStamps();
  const std::vector<ImuSample> imu = source.imuMeasurements();
  std::vector<std::pair<double, size_t>> candidates;
  for (size_t first = 0; first + block <= stamps.size(); first += block)
    candidates.emplace_back(-gyroSpread(imu, stamps, first, block), first);
  std::sort(candidates.begin(), candidates.end());
  if (candidates.size() > count) candidates.resize(count);
  std::vector<size_t> firsts;
  firsts.reserve(candidates.size());
  for (const auto& candidate : candidates) firsts.push_back(candidate.second);
  std::sort(firsts.begin(), firsts.end());
  return firsts;
}

}  // namespace

std::vector<RotationStep> measureCameraRotation(RecordedSource& source, size_t max_frames,
                                                ImageProblems* problems) {
  const std::vector<TimeNs>& stamps = source.imageStamps();
  const size_t block =
      stamps.size() <= max_frames ? stamps.size() : std::min(kBlockFrames, max_frames);
  std::vector<RotationStep> steps;
  if (block < 2) return steps;
  for (const size_t first : chooseBlocks(source, block, std::max<size_t>(1, max_frames / block))) {
    RotationTracker tracker(source.calibration().cameras[0].model);
    size_t previous = first;
    for (size_t i = first; i < first + block; ++i) {
      const LoadedFrame loaded = source.loadFrame(i);
      if (!loaded.problem.empty()) {
        if (problems) (*problems)[i] = describe(loaded);
        continue;
      }
      const auto rotation = tracker.add(loaded.frame.left);
      if (rotation) steps.push_back({stamps[previous], stamps[i], *rotation});
      previous = i;
    }
  }
  return steps;
}

}  // namespace etalon
