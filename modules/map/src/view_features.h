#pragma once

// How a view looks: ORB features (Rublee et al., ORB: An efficient alternative to SIFT or SURF, ICCV
// 2011), by which it is recognised without a prediction. Private to the module.

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "etalon/map/view_geometry.h"

namespace etalon {

struct ImageFeatures {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;  ///< a row each
};
ImageFeatures detectFeatures(const cv::Mat& image);

/** The features of a view's left image that its right one shows, too. */
struct ViewFeatures {
  cv::Mat descriptors;                  ///< a row each
  std::vector<SeenLandmark> landmarks;  ///< where they are in the body's frame of the view
};
ViewFeatures triangulateFeatures(const StereoInertialCalibration& calibration, const cv::Mat& left,
                                 const cv::Mat& right);

/** Where the view is that has these features: RANSAC over perspective three-point problems. */
std::optional<OldView> viewByFeatures(const StereoInertialCalibration& calibration,
                                      const ViewFeatures& view, const ImageFeatures& current);

}  // namespace etalon
