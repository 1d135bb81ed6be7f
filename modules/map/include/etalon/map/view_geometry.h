#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/se3.h"
#include "etalon/map/map_options.h"
#include "etalon/map/view_matcher.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon {

/** A landmark that the current frame sees; N is the body there. */
struct SeenLandmark {
  LandmarkId id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();       ///< raw, in the left image
  Eigen::Vector3d p_N = Eigen::Vector3d::Zero();         ///< m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of p_N, given the poses, m^2
};

/** A landmark at a distance that is known to the share `sigma_distance` of it, in a direction that
 * is known to `sigma_direction` (rad). @param p_N in the body's frame, m */
SeenLandmark seenLandmark(const SE3& T_BC, LandmarkId id, const Eigen::Vector2d& pixel,
                          const Eigen::Vector3d& p_N, double sigma_distance,
                          double sigma_direction);

/** The current frame against the view: T_VN and its covariance. */
OldView inverse(const OldView& view);

/** Whether the view's left camera should see the landmark, from a direction (35 degrees) and a
 * distance (a factor of two) that are not very different. */
bool isInView(const StereoInertialCalibration& calibration, const SE3& T_NV,
              const SeenLandmark& landmark);

/**
 * Where the view should show the landmark, and how far from there it may be (3 standard deviations
 * and 2 px); nothing where that is not isInView().
 * @param sigma_px of a pixel
 */
std::optional<ViewQuery> predictInView(const StereoInertialCalibration& calibration,
                                       const OldView& view, const SeenLandmark& landmark,
                                       double sigma_px);

/** A landmark that was found in a view, as measurements of its cameras. */
struct FoundLandmark {
  size_t landmark = 0;  ///< index of the SeenLandmark
  ViewMatch match;
  std::array<ReprojectionMeasurement, 2> measurements;
};

/** The landmark of that index where a view shows it; nothing if its left camera cannot.
 * @param sigma_px of a pixel */
std::optional<FoundLandmark> foundLandmark(const StereoInertialCalibration& calibration,
                                           size_t landmark, const ViewMatch& match,
                                           double sigma_px);

/**
 * The found landmarks that agree with the prediction, whose covariance is the view's and the
 * landmark's, and with each other about where the view is. Empty if fewer than
 * options.min_landmarks or less than half of them agree, or if they put the view where its
 * covariance does not allow it.
 */
std::vector<FoundLandmark> agreeing(const StereoInertialCalibration& calibration,
                                    const OldView& view, const std::vector<SeenLandmark>& landmarks,
                                    const std::vector<FoundLandmark>& found, double pixel_variance,
                                    const MapOptions& options);

/** The view where its prediction and the found landmarks have it, robustly (Cauchy). */
OldView aligned(const StereoInertialCalibration& calibration, const OldView& view,
                const std::vector<SeenLandmark>& landmarks, const std::vector<FoundLandmark>& found,
                double pixel_variance);

}  // namespace etalon
