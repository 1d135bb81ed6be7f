#include "etalon/odometry/stereo_odometry.h"

#include <algorithm>
#include <set>

#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/pose_only.h"

namespace etalon {

void StereoOdometryOptions::declare(ParameterSet& parameters) {
  parameters.add("sigma_px", &sigma_px, {0.01, 100.0},
                 "Standard deviation of a tracked pixel coordinate, px.");
  parameters.add("pose_chi2", &pose_chi2, {0.1, 1e9},
                 "Stereo odometry (until a start is accepted; with kind = stereo_visual after it, "
                 "too): squared residual (in sigma_px) above which a landmark is an outlier of a "
                 "frame's pose; wider than the 95 % of 5.991, because the landmarks are not exact "
                 "either.");
  parameters.add(
      "min_pose_inliers", &min_pose_inliers, {6, 10000},
      "Stereo odometry: a frame that fewer measurements agree on is not located, and its "
      "pose is predicted.");
  parameters.add("window_keyframes", &window_keyframes, {2, 100},
                 "Stereo odometry: keyframes in the window of its bundle adjustment.");
  parameters.add("ba_rounds", &ba_rounds, {0, 10},
                 "Stereo odometry: rounds of bundle adjustment at every keyframe; 0: none.");
  parameters.add("ba_iterations", &ba_iterations, {1, 200}, "Iterations of such a round, at most.");
  parameters.add("max_prediction_s", &max_prediction_s, {0.0, 1e6},
                 "Stereo odometry: where no frame can be located, the last velocity is kept for "
                 "this long, s; from then on the position stays.");
}

StereoOdometry::StereoOdometry(const StereoInertialCalibration& calibration,
                               const StereoOdometryOptions& options)
    : calibration_(calibration), options_(options) {
  for (size_t c = 0; c < 2; ++c) T_CB_[c] = calibration.cameras[c].T_BC.inverse();
}

SE3 StereoOdometry::predict(TimeNs t, const Eigen::Matrix3d& R_prev_cur) const {
  if (!started_) return T_VB_;
  const auto believed_s = [this](TimeNs until) {
    return std::min(secondsBetween(located_.t, until), options_.max_prediction_s);
  };
  return {T_VB_.R * R_prev_cur, T_VB_.t + v_VB_ * (believed_s(t) - believed_s(t_))};
}

StereoOdometry::FrameResult StereoOdometry::track(const TrackedFrame& frame,
                                                  const Eigen::Matrix3d& R_prev_cur,
                                                  bool keyframe) {
  FrameResult result;
  if (!started_) {
    started_ = true;
    result.located = true;
  } else {
    std::vector<PointMeasurement> measurements;
    std::vector<LandmarkId> measured;
    measurements.reserve(2 * frame.observations.size());
    measured.reserve(measurements.capacity());
    for (const Observation& o : frame.observations) {
      const auto landmark = landmarks_.find(o.id);
      if (landmark == landmarks_.end()) continue;
      for (int camera = 0; camera < (o.has_right ? 2 : 1); ++camera)
        if (const auto m = makeMeasurement(calibration_.cameras[camera].model,
                                           camera == 0 ? o.left : o.right, options_.sigma_px)) {
          measurements.push_back({landmark->second, camera, *m});
          measured.push_back(o.id);
        }
    }
    const SE3 predicted = predict(frame.t, R_prev_cur);
    PoseOnlyOptions pose_options;
    pose_options.chi2_threshold = options_.pose_chi2;
    const PoseOnlyResult pose = solvePoseOnly(T_CB_, measurements, predicted, pose_options);
    result.inliers = pose.inliers;
    std::set<LandmarkId> used;
    for (size_t i = 0; i < measured.size(); ++i)
      if (pose.inlier[i]) used.insert(measured[i]);
    result.used = used.size();
    result.located = pose.summary.usable() && pose.inliers >= options_.min_pose_inliers;
    const SE3 T_VB = result.located ? pose.T_WB : predicted;
    const double dt = secondsBetween(located_.t, frame.t);
    if (result.located && dt > 0) v_VB_ = (T_VB.t - located_.T_WB.t) / dt;
    T_VB_ = T_VB;
  }
  t_ = frame.t;
  if (result.located) located_ = {t_, T_VB_};
  // A frame that could not be located starts the map anew from its predicted pose.
  if (keyframe || !result.located) addKeyframe(frame);
  result.T_VB = T_VB_;
  return result;
}

void StereoOdometry::begin(const TrackedFrame& frame, const SE3& T_VB, const Eigen::Vector3d& v_VB,
                           const std::map<LandmarkId, Eigen::Vector3d>& landmarks) {
  keyframes_.clear();
  landmarks_ = landmarks;
  started_ = true;
  t_ = frame.t;
  T_VB_ = T_VB;
  v_VB_ = v_VB;
  located_ = {t_, T_VB_};
  addKeyframe(frame);
}

void StereoOdometry::addKeyframe(const TrackedFrame& frame) {
  keyframes_.push_back({frame, T_VB_});
  while (static_cast<int>(keyframes_.size()) > options_.window_keyframes) keyframes_.pop_front();
  triangulateNewLandmarks(frame);
  if (options_.ba_rounds > 0 && keyframes_.size() > 1) {
    StereoBaOptions ba;
    ba.rounds = options_.ba_rounds;
    ba.iterations_per_round = options_.ba_iterations;
    bundleAdjust(ba);
  } else {
    forgetUnseen();
  }
}

/** What no keyframe of the window sees will not be observed again. */
void StereoOdometry::forgetUnseen() {
  std::map<LandmarkId, Eigen::Vector3d> kept;
  for (const WindowKeyframe& keyframe : keyframes_)
    for (const Observation& o : keyframe.frame.observations)
      if (const auto known = landmarks_.find(o.id); known != landmarks_.end()) kept.insert(*known);
  landmarks_ = std::move(kept);
}

void StereoOdometry::triangulateNewLandmarks(const TrackedFrame& frame) {
  TrackedFrame unknown;
  unknown.t = frame.t;
  for (const Observation& o : frame.observations)
    if (o.has_right && landmarks_.count(o.id) == 0) unknown.observations.push_back(o);
  const VisualWindow window = buildVisualWindow(calibration_, {&unknown}, options_.sigma_px);
  for (int l = 0; l < window.landmarkCount(); ++l)
    if (const auto p_V = triangulate(window, l, {T_VB_})) landmarks_[window.landmark_ids[l]] = *p_V;
}

StereoBaResult StereoOdometry::bundleAdjust(const StereoBaOptions& options) {
  std::vector<const TrackedFrame*> frames;
  std::vector<SE3> poses;
  for (const WindowKeyframe& k : keyframes_) {
    frames.push_back(&k.frame);
    poses.push_back(k.T_VB);
  }
  BundleProblem bundle(buildVisualWindow(calibration_, frames, options_.sigma_px), landmarks_);
  bundle.triangulateMissing(poses);
  StereoBaResult result = solveStereoBa(std::move(bundle), poses, options);
  for (size_t k = 0; k < keyframes_.size(); ++k) {
    keyframes_[k].T_VB = result.T_VB[k];
    if (keyframes_[k].frame.t == located_.t) located_.T_WB = result.T_VB[k];
  }
  T_VB_ = keyframes_.back().T_VB;
  // Keep the landmarks of the window only: what it no longer sees will not be observed again.
  std::map<LandmarkId, Eigen::Vector3d> kept = result.bundle.validLandmarks();
  for (const Observation& o : keyframes_.back().frame.observations) {
    const auto known = landmarks_.find(o.id);
    if (known != landmarks_.end() && !result.bundle.window.contains(o.id)) kept.insert(*known);
  }
  landmarks_ = std::move(kept);
  return result;
}

Trajectory StereoOdometry::keyframes() const {
  Trajectory keyframes;
  for (const WindowKeyframe& k : keyframes_) keyframes.push_back({k.frame.t, k.T_VB});
  return keyframes;
}

}  // namespace etalon
