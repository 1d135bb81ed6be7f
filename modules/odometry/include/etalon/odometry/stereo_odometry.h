#pragma once

#include <deque>
#include <map>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"
#include "etalon/optimization/bundle/stereo_ba.h"

namespace etalon {

/** Section [odometry]. */
struct StereoOdometryOptions {
  double sigma_px = kTrackSigmaPx;
  double pose_chi2 = 16.0;
  int min_pose_inliers = 12;
  int window_keyframes = 10;
  int ba_rounds = 1;
  int ba_iterations = 5;
  double max_prediction_s = 2.0;

  void declare(ParameterSet& parameters);
};

/**
 * Stereo visual odometry: every frame's pose from the landmarks known so far (PnP), and bundle
 * adjustment over a window of keyframes. Its frame V starts at the first frame's body.
 */
class StereoOdometry {
 public:
  StereoOdometry(const StereoInertialCalibration& calibration,
                 const StereoOdometryOptions& options);

  struct FrameResult {
    SE3 T_VB;
    int inliers = 0;       ///< measurements that agree on the pose
    int used = 0;          ///< landmarks that they are of
    bool located = false;  ///< false: too few landmarks agreed, the pose is the prediction
  };

  /**
   * @param R_prev_cur rotation of the body since the previous frame as the gyro saw it
   * @param keyframe whether the frame joins the window: its new landmarks are triangulated
   */
  FrameResult track(const TrackedFrame& frame, const Eigen::Matrix3d& R_prev_cur, bool keyframe);

  /** Forgets everything and begins at `frame`, which may have no observations, with the body's pose
   * and velocity (m/s). @param landmarks that are known, p_V, m; those of the frame that are not
   * among them are triangulated */
  void begin(const TrackedFrame& frame, const SE3& T_VB, const Eigen::Vector3d& v_VB,
             const std::map<LandmarkId, Eigen::Vector3d>& landmarks = {});

  /** The pose at `t`, not before the last frame's: turned as the gyro saw it, moved at the last
   * known velocity until max_prediction_s after the last frame that was located. */
  SE3 predict(TimeNs t, const Eigen::Matrix3d& R_prev_cur) const;

  /** Bundle adjustment over the window; the first keyframe is fixed. Updates poses and landmarks.
   */
  StereoBaResult bundleAdjust(const StereoBaOptions& options);

  const SE3& pose() const { return T_VB_; }
  /** From the last two frames that were located, m/s. */
  const Eigen::Vector3d& velocity() const { return v_VB_; }
  /** Poses of the window's keyframes, the oldest first. */
  Trajectory keyframes() const;
  const std::map<LandmarkId, Eigen::Vector3d>& landmarks() const { return landmarks_; }

 private:
  struct WindowKeyframe {
    TrackedFrame frame;
    SE3 T_VB;
  };
  void addKeyframe(const TrackedFrame& frame);
  void triangulateNewLandmarks(const TrackedFrame& frame);
  void forgetUnseen();

  StereoInertialCalibration calibration_;
  StereoOdometryOptions options_;
  std::array<SE3, 2> T_CB_;
  bool started_ = false;
  TimeNs t_ = 0;  ///< of T_VB_
  SE3 T_VB_;
  StampedPose located_;  ///< of the last frame that was located, in V
  Eigen::Vector3d v_VB_ = Eigen::Vector3d::Zero();
  std::deque<WindowKeyframe> keyframes_;
  std::map<LandmarkId, Eigen::Vector3d> landmarks_;
};

}  // namespace etalon
