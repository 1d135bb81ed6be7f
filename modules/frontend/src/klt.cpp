#include "klt.h"

#include <algorithm>
#include <opencv2/video/tracking.hpp>

namespace etalon {

namespace {
// OpenCV's default: patches flatter than this are not followed.
constexpr double kMinEigenvalue = 1e-4;
// A smaller change of brightness moves a point by a few hundredths of a pixel.
constexpr double kBrightnessChange = 1.03;
constexpr int kGrayRadius = 1;  // of the pixels that are summed

/** Sum of the gray levels around a point, at an eighth of the resolution or the coarsest there is; 0
 * at the edge of the image. */
int grayAround(const Pyramid& pyramid, const cv::Point2f& point) {
  constexpr int kLevel = 3;
  const int level = std::min(kLevel, static_cast<int>(pyramid.size()) / 2 - 1);
  const cv::Mat& image = pyramid[2 * level];  // every second one has derivatives
  const float scale = 1.0F / static_cast<float>(1 << level);
  const int x = cvRound(point.x * scale), y = cvRound(point.y * scale);
  if (x < kGrayRadius || y < kGrayRadius || x >= image.cols - kGrayRadius ||
      y >= image.rows - kGrayRadius)
    return 0;
  int sum = 0;
  for (int v = y - kGrayRadius; v <= y + kGrayRadius; ++v) {
    const uchar* row = image.ptr<uchar>(v);
    for (int u = x - kGrayRadius; u <= x + kGrayRadius; ++u) sum += row[u];
  }
  return sum;
}

/** How many times brighter an image is than the one before: the median over the points. 1 where too
 * few of them can be compared. */
double brightnessRatio(const Pyramid& from_image, const Pyramid& to_image,
                       const std::vector<cv::Point2f>& from, const std::vector<cv::Point2f>& to) {
  constexpr int kPixels = (2 * kGrayRadius + 1) * (2 * kGrayRadius + 1);
  constexpr int kDark = 10 * kPixels, kBright = 240 * kPixels;  // beyond them they are clipped
  constexpr size_t kFewest = 20;
  std::vector<double> ratios;
  for (size_t i = 0; i < from.size(); ++i) {
    const int before = grayAround(from_image, from[i]), now = grayAround(to_image, to[i]);
    if (std::min(before, now) > kDark && std::max(before, now) < kBright)
      ratios.push_back(static_cast<double>(now) / before);
  }
  if (ratios.size() < kFewest) return 1.0;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

/** What is white in a brighter image becomes white, too. */
Pyramid brightened(const Pyramid& pyramid, double ratio, const StereoTrackerOptions& options) {
  cv::Mat image;
  pyramid[0].convertTo(image, CV_8U, ratio);
  return buildPyramid(image, options);
}

/** KLT between images of one exposure. */
std::vector<char> followConstant(const Pyramid& from_image, const Pyramid& to_image,
                                 const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>* to,
                                 const StereoTrackerOptions& options) {
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS,
                                  options.klt_iterations, options.klt_epsilon_px);
  std::vector<uchar> found;
  cv::calcOpticalFlowPyrLK(from_image, to_image, from, *to, found, cv::noArray(),
                           {options.klt_window_px, options.klt_window_px}, options.klt_levels,
                           criteria, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  return {found.begin(), found.end()};
}

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
  const double ratio = brightnessRatio(from_image, to_image, from, *to);
  if (ratio > kBrightnessChange)
    return followConstant(brightened(from_image, ratio, options), to_image, from, to, options);
  if (ratio < 1.0 / kBrightnessChange)
    return followConstant(from_image, brightened(to_image, 1.0 / ratio, options), from, to,
                          options);
  return followConstant(from_image, to_image, from, to, options);
}

}  // namespace etalon
