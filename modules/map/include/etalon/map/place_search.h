#pragma once

#include <map>
#include <memory>
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
 * Recognises old views without knowing where the body is. A first guess comes from how a view looks
 * (ImageViews::recognize()). From there on the view is one of the map: landmarks are found in it by
 * their patches, and must agree.
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

  /** Makes one place ready of which that is still to be done. Places are looked at after that. */
  void prepareOne();

  /** Looks at two of the places, at the next ones with every call; some 15 ms.
   * @param landmarks that the current frame sees */
  std::optional<Sighting> look(const std::vector<SeenLandmark>& landmarks);
  /** The same where it is known about where the body is: at the place that shows most of the
   * landmarks, some 2 ms. @param covariance of T_WN: [rotation by right perturbation, position] */
  std::optional<Sighting> lookNear(const SE3& T_WN, const Eigen::Matrix<double, 6, 6>& covariance,
                                   const std::vector<SeenLandmark>& landmarks) const;

 private:
  std::optional<Sighting> confirm(TimeNs place, const OldView& guess,
                                  const std::vector<SeenLandmark>& landmarks) const;

  StereoInertialCalibration calibration_;
  MapOptions options_;
  double sigma_px_;
  std::shared_ptr<ImageViews> views_;
  std::map<TimeNs, SE3> places_;  ///< T_WB
  size_t next_ = 0;               ///< place to look at, counted from the newest
};

}  // namespace etalon
