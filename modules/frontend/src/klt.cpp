#include "klt.h"

#include <opencv2/video/tracking.hpp>

namespace etalon {

namespace {
// OpenCV's default: patches flatter than this are not followed.
constexpr double kMinEigenvalue = 1e-4;
// The way back starts at the right place: one coarse level is enough to notice a wrong way there.
constexpr int kBackwardLevels = 1;
}  // namespace

Pyramid buildPyramid(const cv::Mat& image, const StereoTrackerOptions& options) {
  Pyramid pyramid;
  cv::buildOpticalFlowPyramid(image, pyramid, {options.klt_window_px, options.klt_window_px},
                              options.klt_levels, true);
  return pyramid;
}

std::vector<char> followPoints(const Pyramid& from_image, const Pyramid& to_image,
                               const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>* to,
                               const StereoTrackerOptions& options) {
  if (from.empty()) return {};
  const cv::Size window(options.klt_window_px, options.klt_window_px);
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS,
                                  options.klt_iterations, options.klt_epsilon_px);
  std::vector<uchar> found, found_back;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from_image, to_image, from, *to, found, error, window,
                           options.klt_levels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW,
                           kMinEigenvalue);
  std::vector<cv::Point2f> back = from;
  cv::calcOpticalFlowPyrLK(to_image, from_image, *to, back, found_back, error, window,
                           std::min(kBackwardLevels, options.klt_levels), criteria,
                           cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  std::vector<char> good(from.size());
  for (size_t i = 0; i < from.size(); ++i)
    good[i] =
        found[i] && found_back[i] && cv::norm(back[i] - from[i]) <= options.forward_backward_px;
  return good;
}

}  // namespace etalon
