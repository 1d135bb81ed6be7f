#pragma once

#include <cstring>
#include <opencv2/core.hpp>

namespace etalon {

/** Whether two images are the same to the bit. Ends at the first row that differs: it is asked for
 * every frame. */
inline bool samePixels(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  if (a.data == b.data) return true;
  const size_t bytes = static_cast<size_t>(a.cols) * a.elemSize();
  for (int y = 0; y < a.rows; ++y)
    if (std::memcmp(a.ptr(y), b.ptr(y), bytes) != 0) return false;
  return true;
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
