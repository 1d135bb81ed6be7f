#pragma once

// Tracks of the front end against the window: which to believe, and the landmarks that they become.
// Private to the module.

#include <map>
#include <unordered_map>

#include "etalon/core/tracked_frame.h"
#include "relative_views.h"
#include "window.h"

namespace etalon::fixed_lag {

constexpr int kLocatedBy = 6;  ///< landmarks that a frame needs to be located

struct TrackOptions {
  double sigma_px = kTrackSigmaPx;
  double chi2_gate = 25.0;
  double chi2_outlier = 16.0;
  double keyframe_survival = 0.7;
  double keyframe_parallax_px = 12.0;
  double least_sigma_px = 0.1;  ///< see FixedLagOptions
};

/** What the front end saw in a frame, undistorted. */
struct MeasuredFrame {
  struct Track {
    LandmarkId id = 0;
    bool has_left = true, has_right = false;
    std::array<ReprojectionMeasurement, 2> measurements;
  };
  TimeNs t = 0;
  std::vector<Track> tracks;  ///< in increasing order of id
};

MeasuredFrame measure(const StereoInertialCalibration& calibration, const TrackedFrame& frame,
                      double sigma_px);

/** Decides about tracks; the window's newest state is always the frame in question. */
class Tracks {
 public:
  Tracks(const StereoInertialCalibration& calibration, const TrackOptions& options)
      : calibration_(&calibration), options_(options) {}

  struct Counts {
    int used = 0, gated = 0;
  };
  /**
   * Gives the window's landmarks their observations in the newest state, except where one is
   * farther from its prediction than the error of the state explains.
   * @param pose_covariance of the newest pose relative to the window, [rotation, position in W]
   */
  Counts associate(const MeasuredFrame& frame, const Eigen::Matrix<double, 6, 6>& pose_covariance,
                   Window* window);

  /** Whether the newest state is to be a keyframe: too few of its tracks are landmarks, or the view
   * has changed. */
  bool wantsKeyframe(const MeasuredFrame& frame, const Counts& counts, const Window& window) const;

  /** Called when the newest state is a keyframe: its tracks that are no landmarks yet become
   * landmarks, triangulated from both cameras or with earlier keyframes. */
  void createLandmarks(const MeasuredFrame& frame, Window* window);

  /**
   * Drops all that the newest image shows if after the optimisation less than a quarter of what it
   * shows of earlier landmarks fits: the image is wrong, as one that a camera repeats, and its tracks
   * may be right again in the next. Where these are less than a quarter of its tracks, as after a
   * while without images, they tell nothing of the others. Returns whether it did.
   * @param frame the newest
   * @param views at the estimates of the window
   */
  bool dropMisfittingImage(const MeasuredFrame& frame, const RelativeViews& views, Window* window);

  struct Fit {
    int used = 0;  ///< landmarks of earlier states that the newest one sees where they are
    /** Squared residuals in sigma_px, for followNoise(): of landmarks that the newest state sees,
     * raised by the share that fitting the landmark has taken off. */
    std::vector<double> squares;
  };
  /** Drops observations that do not fit after the optimisation, and landmarks that keep failing.
   * @param views at the estimates of the window */
  Fit dropOutliers(const RelativeViews& views, Window* window);

  /** Odometry::moveWorld() turns it so. */
  void turnWorld(const Eigen::Matrix3d& R_WW0) { last_R_WB_ = R_WW0 * last_R_WB_; }

  /** Tracks without a distance begin anew: their measurements are of another calibration. */
  void forgetPending() { pending_.clear(); }

  /** Lets the window's pixel variance follow the median of Fit::squares. */
  void followNoise(std::vector<double> squares, Window* window) const;

 private:
  void forgetEndedTracks(const MeasuredFrame& frame);
  /** Whether the observation is where its landmark is. @param squares of its residuals, by camera */
  bool fits(const RelativeViews& views, const RelativeViews::Ray& ray, int host,
            const LandmarkObservation& o, std::array<double, 2>* squares = nullptr) const;

  const StereoInertialCalibration* calibration_;
  TrackOptions options_;
  std::map<LandmarkId, int> rejected_;  ///< tracks that failed, and frames since they were seen
  /** In keyframes, of tracks whose distance is not known yet. */
  std::map<LandmarkId, std::vector<LandmarkObservation>> pending_;
  struct Ray {
    bool has_left = true;  ///< of the left camera, else of the right one
    Eigen::Vector3d ray;   ///< in the axes of the body
  };
  /** In the last keyframe, and its attitude. */
  std::unordered_map<LandmarkId, Ray> last_keyframe_;
  Eigen::Matrix3d last_R_WB_ = Eigen::Matrix3d::Identity();
  TimeNs last_keyframe_at_ = 0;
};

}  // namespace etalon::fixed_lag
