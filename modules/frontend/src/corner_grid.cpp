#include "corner_grid.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace etalon {

CornerGrid::CornerGrid(cv::Size image, const StereoTrackerOptions& options)
    : options_(options), free_(image, CV_8U, cv::Scalar(0)) {
  const cv::Rect inner(options.border_px, options.border_px, image.width - 2 * options.border_px,
                       image.height - 2 * options.border_px);
  if (inner.width > 0 && inner.height > 0) free_(inner).setTo(255);
  const double cell = std::sqrt(static_cast<double>(image.area()) / options.max_features);
  columns_ = std::max(1, static_cast<int>(image.width / cell));
  rows_ = std::max(1, static_cast<int>(image.height / cell));
  cell_width_ = static_cast<double>(image.width) / columns_;
  cell_height_ = static_cast<double>(image.height) / rows_;
  taken_.assign(columns_ * rows_, 0);
}

bool CornerGrid::claim(const cv::Point2f& pixel) {
  const cv::Point nearest(cvRound(pixel.x), cvRound(pixel.y));
  if (!cv::Rect({0, 0}, free_.size()).contains(nearest) || free_.at<uchar>(nearest) == 0)
    return false;
  cv::circle(free_, nearest, cvRound(options_.min_distance_px), 0, cv::FILLED);
  const int column = std::min(columns_ - 1, static_cast<int>(pixel.x / cell_width_));
  const int row = std::min(rows_ - 1, static_cast<int>(pixel.y / cell_height_));
  taken_[row * columns_ + column] = 1;
  return true;
}

std::vector<cv::Point2f> CornerGrid::detect(const cv::Mat& image, int count) {
  struct Candidate {
    double response;
    cv::Point pixel;
  };
  constexpr int kBlock = 5, kSobel = 3;
  std::vector<Candidate> candidates;
  cv::Mat response;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      if (taken_[row * columns_ + column]) continue;
      const cv::Rect cell(cvFloor(column * cell_width_), cvFloor(row * cell_height_),
                          cvFloor(cell_width_), cvFloor(cell_height_));
      // A region of interest: the filters see the pixels around it, so cells have no seams.
      cv::cornerMinEigenVal(image(cell), response, kBlock, kSobel);
      Candidate best{0.0, {}};
      cv::minMaxLoc(response, nullptr, &best.response, nullptr, &best.pixel, free_(cell));
      best.pixel += cell.tl();
      if (best.response >= options_.min_corner_response) candidates.push_back(best);
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.response > b.response; });
  std::vector<cv::Point2f> corners;
  for (const Candidate& c : candidates) {
    if (static_cast<int>(corners.size()) >= count) break;
    const cv::Point2f pixel(static_cast<float>(c.pixel.x), static_cast<float>(c.pixel.y));
    if (claim(pixel)) corners.push_back(pixel);
  }
  return corners;
}

}  // namespace etalon
