#pragma once

// New corners where the image has no landmarks yet. Private to the module.

#include <opencv2/core.hpp>
#include <vector>

#include "etalon/frontend/stereo_tracker.h"

namespace etalon {

/**
 * The image in cells, one wanted landmark each; remembers which cells are taken and which pixels
 * are too near to a landmark.
 */
class CornerGrid {
 public:
  CornerGrid(cv::Size image, const StereoTrackerOptions& options);

  /** Claims the place of a landmark; false if another one is nearer than the minimal distance. */
  bool claim(const cv::Point2f& pixel);

  /** The strongest corner (Shi-Tomasi) of every free cell, strongest first, at most `count`; claims
   * their places. */
  std::vector<cv::Point2f> detect(const cv::Mat& image, int count);

 private:
  const StereoTrackerOptions& options_;
  cv::Mat free_;  ///< CV_8U, 255 where a landmark may stand
  int columns_ = 1, rows_ = 1;
  double cell_width_ = 1, cell_height_ = 1;
  std::vector<char> taken_;
};

}  // namespace etalon
