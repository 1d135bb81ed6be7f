#include "corner_grid.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace etalon {

namespace {

constexpr int kBlock = 5;  // px, of the window that the structure tensor is summed over
constexpr int kReach = kBlock / 2 + 1;  // of the window and of the Sobel filter

/** Sums over the window around every element but those of the border. */
Eigen::ArrayXXf windowSums(const Eigen::ArrayXXf& values) {
  static_assert(kBlock == 5);
  const Eigen::Index width = values.rows() - kBlock + 1, height = values.cols() - kBlock + 1;
  const auto column = [&](int i) { return values.middleCols(i, height); };
  const Eigen::ArrayXXf down = column(0) + column(1) + column(2) + column(3) + column(4);
  const auto row = [&](int i) { return down.middleRows(i, width); };
  return row(0) + row(1) + row(2) + row(3) + row(4);
}

/**
 * Least eigenvalue of the structure tensor (Shi and Tomasi 1994) in the scale of OpenCV's
 * cornerMinEigenVal, which takes several times as long on a small cell.
 * @param cell at least kReach inside the image
 * @return a column for each row of the cell
 */
Eigen::ArrayXXf cornerResponse(const cv::Mat& image, const cv::Rect& cell) {
  const int width = cell.width + kBlock - 1, height = cell.height + kBlock - 1;
  Eigen::ArrayXXf xx(width, height), xy(width, height), yy(width, height);
  for (int v = 0; v < height; ++v) {
    const int left = cell.x - kReach, above = cell.y - kReach + v;
    const uchar* row = image.ptr<uchar>(above) + left;
    const uchar* middle = image.ptr<uchar>(above + 1) + left;
    const uchar* below = image.ptr<uchar>(above + 2) + left;
    float *to_xx = &xx(0, v), *to_xy = &xy(0, v), *to_yy = &yy(0, v);
    for (int u = 0; u < width; ++u) {
      const int falling = below[u + 2] - row[u], rising = row[u + 2] - below[u];
      const auto x = static_cast<float>(falling + rising + 2 * (middle[u + 2] - middle[u]));
      const auto y = static_cast<float>(falling - rising + 2 * (below[u + 1] - row[u + 1]));
      to_xx[u] = x * x;
      to_xy[u] = x * y;
      to_yy[u] = y * y;
    }
  }
  constexpr float kScale = 1.0F / (4 * kBlock * 255);
  const Eigen::ArrayXXf a = windowSums(xx), b = windowSums(xy), c = windowSums(yy);
  return 0.5F * kScale * kScale * (a + c - ((a - c).square() + 4.0F * b.square()).sqrt());
}

}  // namespace

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
    float response;
    cv::Point pixel;
  };
  const cv::Rect inside(kReach, kReach, image.cols - 2 * kReach, image.rows - 2 * kReach);
  std::vector<Candidate> candidates;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      if (taken_[row * columns_ + column]) continue;
      const cv::Rect cell =
          inside & cv::Rect(cvFloor(column * cell_width_), cvFloor(row * cell_height_),
                            cvFloor(cell_width_), cvFloor(cell_height_));
      if (cell.empty()) continue;
      const Eigen::ArrayXXf response = cornerResponse(image, cell);
      Candidate best{0.0F, {}};
      for (int v = 0; v < cell.height; ++v) {
        if (!(response.col(v).maxCoeff() > best.response)) continue;
        const uchar* free = free_.ptr<uchar>(cell.y + v) + cell.x;
        for (int u = 0; u < cell.width; ++u)
          if (free[u] && response(u, v) > best.response) best = {response(u, v), {u, v}};
      }
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
