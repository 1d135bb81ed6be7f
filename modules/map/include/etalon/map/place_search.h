#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/map/image_views.h"
#include "etalon/map/view_geometry.h"

namespace etalon {

/** A place that the current frame shows again. */
struct Sighting {
  TimeNs place = 0;
  SE3 T_WP;      ///< of the body there, as it is remembered
  OldView view;  ///< that body in the current one's frame N
  /** Pixels of landmarks of the current frame, in the images of the place. */
  std::vector<Observation> observations;
};

/**
 * Recognises old views without knowing where the body is. ORB features (Rublee et al., ORB: An
 * efficient alternative to SIFT or SURF, ICCV 2011) of a view's pair, triangulated, are matched with
 * those of the current left image; RANSAC over perspective three-point problems gives a first pose.
 * From there on the view is one of the map: landmarks are found in it by their patches, and must
 * agree.
 */
class PlaceSearch {
 public:
  /** @param views has the images of places and of the current frame
   * @param sigma_px of a pixel that was found in a view */
  PlaceSearch(const StereoInertialCalibration& calibration, const MapOptions& options,
              double sigma_px, std::shared_ptr<ImageViews> views);

  /** Remembers keyframes whose images the views have, and those from before: max_keyframes of them,
   * as different as possible. @param keyframes T_WB, in increasing order of time */
  void remember(const Trajectory& keyframes);

  /** Triangulates the features of a place of which that is still to be done, some 20 ms. Places are
   * looked at after that. */
  void prepareOne();

  /** Looks at two of the places, at the next ones with every call; some 15 ms.
   * @param landmarks that the current frame sees */
  std::optional<Sighting> look(const std::vector<SeenLandmark>& landmarks);
  /** The same where it is known about where the body is: at the place that shows most of the
   * landmarks, some 2 ms. @param covariance of T_WN: [rotation by right perturbation, position] */
  std::optional<Sighting> lookNear(const SE3& T_WN, const Eigen::Matrix<double, 6, 6>& covariance,
                                   const std::vector<SeenLandmark>& landmarks) const;

 private:
  struct Place {
    SE3 T_WB;
    bool prepared = false;
    cv::Mat descriptors;                  ///< a row each
    std::vector<SeenLandmark> landmarks;  ///< where they are in the body's frame there
  };
  void prepare(TimeNs t, Place* place) const;
  std::optional<OldView> firstGuess(const Place& place, const std::vector<cv::KeyPoint>& keypoints,
                                    const cv::Mat& descriptors) const;
  std::optional<Sighting> confirm(TimeNs place, const OldView& guess,
                                  const std::vector<SeenLandmark>& landmarks) const;

  StereoInertialCalibration calibration_;
  MapOptions options_;
  double sigma_px_;
  std::shared_ptr<ImageViews> views_;
  std::map<TimeNs, Place> places_;
  size_t next_ = 0;  ///< place to look at, counted from the newest
};

/** A landmark at a distance that is known to the share `sigma_distance` of it, in a direction that
 * is known to `sigma_direction` (rad). @param p_N in the body's frame, m */
SeenLandmark seenLandmark(const SE3& T_BC, LandmarkId id, const Eigen::Vector2d& pixel,
                          const Eigen::Vector3d& p_N, double sigma_distance,
                          double sigma_direction);

}  // namespace etalon
