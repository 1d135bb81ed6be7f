#pragma once

// The tracks of a stereo camera, followed from frame to frame. Private to the module.

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/frontend/anchor_patch.h"
#include "etalon/frontend/stereo_tracker.h"
#include "klt.h"

namespace etalon {

/** A landmark in the image of the camera that is followed; the "other" image is of the other camera. */
struct Track {
  LandmarkId id = -1;
  cv::Point2f pixel;
  cv::Point2f pixel_before{};   ///< in the frame before
  cv::Point2f matched{};        ///< in the other image of the last frame, if inverse_depth is known
  double inverse_depth = -1.0;  ///< 1/m, in the camera that is followed; negative if not matched
  AnchorPatch anchor{};         ///< what it looked like when it was found
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();        ///< of the anchor in the current image
  Eigen::Matrix2d A_other = Eigen::Matrix2d::Identity();  ///< in the other one
  int unanchored = 0;  ///< frames in a row in which the anchor did not fit
  int unmatched = 0;   ///< frames in a row without a match in the other image
};

/**
 * Follows tracks by pyramidal KLT from a guess by the gyro's rotation, then takes back by the tracks'
 * anchors what it has drifted. The left camera is followed until it shows nothing any more, as with
 * a covered lens, and the right one still does; then the right one is, and so on.
 */
class TrackFollower {
 public:
  TrackFollower(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options);

  /**
   * Takes the tracks to these images. Those that KLT loses are dropped, and so are those that their
   * anchors do not fit any more: with new anchors they would be other points, which earlier
   * sightings are not of.
   * @param images left, right
   * @param R_prev_cur rotation of the body, R_B(prev)B(cur)
   */
  void follow(const std::array<const cv::Mat*, 2>& images, const Eigen::Matrix3d& R_prev_cur,
              std::vector<Track>* tracks);

  /** The camera that is followed: 0 left, 1 right. */
  size_t followed() const { return followed_; }
  /** Calibration with the camera that is followed first. */
  const StereoInertialCalibration& rig() const { return rigs_[followed_]; }
  /** That with camera `c` first. */
  const StereoInertialCalibration& rig(size_t c) const { return rigs_[c]; }
  /** The last image that was followed. */
  const Pyramid& pyramid() const { return pyramid_; }
  /** Rotation of the camera that is followed, R_C(cur)C(prev). */
  Eigen::Matrix3d ofCamera(const Eigen::Matrix3d& R_prev_cur) const {
    return ofCamera(followed_, R_prev_cur);
  }

 private:
  /** Tracks that are sought or found again in an image. */
  struct Followed {
    std::vector<size_t> tracks;
    std::vector<cv::Point2f> from, to;
    std::vector<std::optional<PatchPose>> anchored;  ///< where the track's anchor fits
    size_t fitting = 0;                              ///< tracks that are anchored
  };

  Eigen::Matrix3d ofCamera(size_t c, const Eigen::Matrix3d& R_prev_cur) const;
  Followed followIn(size_t c, const Pyramid& before, const Pyramid& now, const cv::Mat& image,
                    const std::vector<Track>& tracks, const Followed& wanted,
                    const Eigen::Matrix3d& R_prev_cur) const;
  std::optional<PatchPose> anchored(const Track& track, const Eigen::Matrix2d& A,
                                    const cv::Point2f& pixel, const cv::Mat& image) const;
  void exchangeCameras(Track* track) const;
  void renewAnchor(const cv::Mat& image, Track* track) const;
  void take(const Followed& found, const cv::Mat& image, std::vector<Track>* tracks) const;

  std::array<StereoInertialCalibration, 2> rigs_;  ///< the second: with the cameras exchanged
  StereoTrackerOptions options_;
  size_t followed_ = 0;
  Pyramid pyramid_;
  cv::Mat other_;  ///< the image beside it
};

}  // namespace etalon
