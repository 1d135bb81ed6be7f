#pragma once

// From the left to the right image of a calibrated pair. Private to the module.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/frontend/anchor_patch.h"
#include "klt.h"

namespace etalon {

/** A left pixel to be found in the right image. */
struct StereoQuery {
  cv::Point2f left;
  Eigen::Vector3d left_ray = Eigen::Vector3d::UnitZ();  ///< CameraModel::unproject of it
  double inverse_depth = -1.0;         ///< 1/m, of the landmark p_C0 = left_ray / inverse_depth;
                                       ///< negative if unknown
  bool search = true;                  ///< along the epipolar curve, if need be
  const AnchorPatch* patch = nullptr;  ///< what to look for, not null
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();  ///< its shape in the right image, a guess
};

struct StereoMatch {
  bool found = false;
  cv::Point2f right;
  double inverse_depth = -1.0;
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();  ///< shape of the patch in the right image
};

/**
 * Right pixels by aligning each landmark's patch with the right image, whatever the two cameras'
 * gains. Where the depth is unknown, or the guess that it gives fails, patches are first compared
 * along the epipolar curve (half resolution, normalised cross-correlation), since near landmarks
 * are displaced by more than an alignment can bridge. A match must correlate, lie on the epipolar
 * line, and have a depth between min_depth_m and infinity.
 */
class StereoMatcher {
 public:
  StereoMatcher(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options);

  /** @param left_half, right_half the images at half resolution (cv::pyrDown) */
  std::vector<StereoMatch> match(const cv::Mat& left_half, const cv::Mat& right,
                                 const cv::Mat& right_half,
                                 const std::vector<StereoQuery>& queries) const;

  /** Inverse depths, 1/m, at which a left point may lie in the right image, between zero and that
   * of min_depth_m; empty (first > second) if there are none. Of a fisheye, all of these. */
  std::pair<double, double> visibleInverseDepths(const Eigen::Vector3d& left_ray) const;

  /** From one inverse depth to the next in the search, 1/m: some 2 px in the right image. */
  double searchStep(const Eigen::Vector3d& left_ray, double inverse_depth) const;

 private:
  /** The right pixel of a left one at an inverse depth; false outside the image. */
  bool rightPixel(const Eigen::Vector3d& left_ray, double inverse_depth, cv::Point2f* right) const;
  double searchInverseDepth(const cv::Mat& left, const cv::Mat& right,
                            const StereoQuery& query) const;
  StereoMatch align(const cv::Mat& right, const StereoQuery& query, double inverse_depth) const;
  StereoMatch check(const StereoQuery& query, const cv::Point2f& right) const;

  const StereoInertialCalibration& calibration_;
  const StereoTrackerOptions& options_;
  SE3 T_C1C0_;
  double focal_ = 0.0;            ///< mean focal length of the right camera, px
  Eigen::AlignedBox2d right_xy_;  ///< around the right image in the plane z = 1, if perspective
};

}  // namespace etalon
