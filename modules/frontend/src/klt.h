#pragma once

// Pyramidal KLT. Private to the module.

#include <opencv2/core.hpp>
#include <vector>

#include "etalon/frontend/stereo_tracker.h"

namespace etalon {

/** An image pyramid with derivatives, built once an image. */
using Pyramid = std::vector<cv::Mat>;

Pyramid buildPyramid(const cv::Mat& image, const StereoTrackerOptions& options);

/**
 * Follows `from` points into another image. KLT takes gray levels for constant: where the exposure has
 * changed between the images, the darker one is brightened before.
 * @param to in: initial guesses; out: positions, subpixel
 * @return one flag a point: found
 */
std::vector<char> followPoints(const Pyramid& from_image, const Pyramid& to_image,
                               const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>* to,
                               const StereoTrackerOptions& options);

}  // namespace etalon
