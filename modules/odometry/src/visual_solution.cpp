#include "etalon/odometry/visual_solution.h"

namespace etalon {

Expected<VisualSolution> solveStereoOdometry(const StereoInertialCalibration& calibration,
                                             const std::vector<const TrackedFrame*>& keyframes,
                                             const std::vector<Eigen::Matrix3d>& R_prev_cur,
                                             const StereoOdometryOptions& options) {
  StereoOdometryOptions window_options = options;
  window_options.window_keyframes = keyframes.size();
  window_options.ba_rounds = 0;
  StereoOdometry odometry(calibration, window_options);
  for (size_t k = 0; k < keyframes.size(); ++k) {
    const auto frame = odometry.track(
        *keyframes[k], k == 0 ? Eigen::Matrix3d::Identity() : R_prev_cur[k - 1], true);
    if (!frame.located)
      return refuse(RefusalStatus::kTooFewTracks, "stereo odometry lost its way at keyframe ", k,
                    ": ", Value(frame.inliers), " measurements agree, at least ",
                    Bound(options.min_pose_inliers), " are wanted");
  }
  StereoBaOptions ba;
  ba.compute_covariance = true;
  const StereoBaResult result = odometry.bundleAdjust(ba);
  if (!result.summary.usable())
    return refuse(RefusalStatus::kNotConverged,
                  "the bundle adjustment of stereo odometry failed: ", result.summary.message);
  VisualSolution solution;
  solution.T_VB = result.T_VB;
  solution.covariance = result.covariance;
  solution.rms_px = result.rms_px_over_sigma * options.sigma_px;
  solution.inliers = result.bundle.inlierCount();
  solution.outliers = static_cast<int>(result.bundle.window.measurements.size()) - solution.inliers;
  solution.landmarks = result.bundle.validLandmarks();
  return solution;
}

}  // namespace etalon
