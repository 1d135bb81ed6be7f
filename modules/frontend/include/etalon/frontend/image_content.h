#pragma once

#include <opencv2/core.hpp>

namespace etalon {

/** Whether two images are the same to the bit. */
inline bool samePixels(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

/** Whether an image shows nothing, by the standard deviation of its gray levels: a covered lens has
 * 1 to 2, the darkest room in use 10. */
inline bool withoutContrast(const cv::Mat& image) {
  constexpr double kNoContrast = 3.0;
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0] < kNoContrast;
}

}  // namespace etalon
