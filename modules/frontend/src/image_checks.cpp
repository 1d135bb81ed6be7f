#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "etalon/core/text.h"
#include "etalon/frontend/image_content.h"
#include "etalon/frontend/recording_inspection.h"

namespace etalon {

namespace {

/** Matches between left and right images, and how many the calibration explains. */
struct StereoMatches {
  int all = 0;
  int agree = 0;            ///< near the epipolar line, in front of the cameras
  int agree_exchanged = 0;  ///< the same if left and right are exchanged
};

/** Whether a pixel of camera 0 and one of camera 1 can show one point in front of both. */
bool agree(const StereoInertialCalibration& calibration, const cv::Point2f& pixel0,
           const cv::Point2f& pixel1) {
  const auto ray0 = calibration.cameras[0].model.unproject({pixel0.x, pixel0.y});
  const auto direction1 = calibration.cameras[1].model.measure({pixel1.x, pixel1.y});
  if (!ray0 || !direction1) return false;
  const SE3 T_C1C0 = calibration.rightFromLeft();
  const double focal = calibration.cameras[1].model.focal().x();
  const Eigen::Vector3d f0 = T_C1C0.R * *ray0, f1 = direction1->ray();
  const Eigen::Vector3d line = direction1->R_MC * T_C1C0.t.cross(f0);
  constexpr double kNearPx = 2.0;
  const double off = line.dot(direction1->xy.homogeneous());
  if (std::abs(off) / line.head<2>().norm() * focal > kNearPx) return false;
  // The inverse depth by least squares of f1 x (f0 + rho t) = 0, as a disparity.
  const Eigen::Vector3d a = f1.cross(T_C1C0.t), b = f1.cross(f0);
  return -a.dot(b) / a.squaredNorm() * focal * calibration.baseline() > -kNearPx;
}

/** Corners followed from the left into the right image, whatever the calibration says of them. */
void addMatches(const StereoInertialCalibration& calibration, const cv::Mat& left,
                const cv::Mat& right, StereoMatches* matches) {
  std::vector<cv::Point2f> corners, found, back;
  cv::goodFeaturesToTrack(left, corners, 300, 0.01, 10);
  if (corners.empty() || left.size() != right.size()) return;
  std::vector<unsigned char> forth_ok, back_ok;
  cv::calcOpticalFlowPyrLK(left, right, corners, found, forth_ok, cv::noArray(), {21, 21}, 4);
  cv::calcOpticalFlowPyrLK(right, left, found, back, back_ok, cv::noArray(), {21, 21}, 4);
  for (size_t i = 0; i < corners.size(); ++i) {
    if (!forth_ok[i] || !back_ok[i] || cv::norm(back[i] - corners[i]) > 0.5) continue;
    ++matches->all;
    if (agree(calibration, corners[i], found[i])) ++matches->agree;
    if (agree(calibration, found[i], corners[i])) ++matches->agree_exchanged;
  }
}

}  // namespace

RecordingFindings checkImages(RecordedSource& source, size_t pairs) {
  RecordingFindings findings;
  const size_t all = source.imageStamps().size();
  const size_t step = source.framePaths(0).first.empty() ? 1 : std::max<size_t>(1, all / pairs);
  size_t read = 0, flat = 0, equal = 0;
  StereoMatches matches;
  for (size_t i = 0; i < all && read < pairs && i < step * pairs; i += step) {
    const LoadedFrame pair = source.loadFrame(i);
    if (!pair.problem.empty()) continue;
    ++read;
    if (withoutContrast(pair.frame.left) || withoutContrast(pair.frame.right)) {
      ++flat;
      continue;
    }
    if (samePixels(pair.frame.left, pair.frame.right)) {
      ++equal;
      continue;
    }
    addMatches(source.calibration(), pair.frame.left, pair.frame.right, &matches);
  }
  const auto report = [&](size_t count, const char* what) {
    if (count == 0) return;
    const std::string sentence =
        source.name() + format(": images: %s in %zu of %zu pairs looked at", what, count, read);
    (count == read ? findings.errors : findings.warnings).push_back(sentence);
  };
  report(flat,
         "an image without contrast (black, white, or a covered lens; gray levels differ by less "
         "than 3)");
  report(equal,
         "left and right image are the same, so no depth can be seen; expected two cameras;");
  constexpr int kEnoughMatches = 30;
  if (matches.all < kEnoughMatches) return findings;
  if (matches.agree_exchanged >= kEnoughMatches && matches.agree_exchanged > 3 * matches.agree)
    findings.errors.push_back(
        source.name() +
        format(": images: of %d matches between left and right %d agree with the calibration, and "
               "%d if cam0 and cam1 are exchanged; expected images and sensor.yaml of the left "
               "camera in cam0",
               matches.all, matches.agree, matches.agree_exchanged));
  else if (2 * matches.agree < matches.all)
    findings.warnings.push_back(
        source.name() +
        format(": images: of %d matches between left and right only %d agree with the calibration; "
               "are intrinsics and T_BS right?",
               matches.all, matches.agree));
  return findings;
}

}  // namespace etalon
