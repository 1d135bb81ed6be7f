#pragma once

#include <vector>

#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/bundle/visual_window.h"
#include "etalon/testing/known_landmarks.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon::testing {

/** A synthetic window with white noise of the calibration's densities and no bias walk, in V, the
 * frame of the first true body. */
struct NoisyWindow {
  explicit NoisyWindow(const SyntheticWindowOptions& options)
      : synthetic(makeSyntheticWindow(options)), bias(options.bias) {
    noise = synthetic.calibration.imu.noise;
    noise.gyro_random_walk = noise.accel_random_walk = 1e-12;  // the synthetic noise is white
    const SE3 T_VW = synthetic.truth[0].T_WB.inverse();
    for (const StampedState& s : synthetic.truth) {
      T_VB.push_back(T_VW * s.T_WB);
      v_VB.emplace_back(T_VW.R * s.v_WB);
    }
    for (const Eigen::Vector3d& p : synthetic.landmarks) landmarks_V.push_back(T_VW * p);
    g_V = T_VW.R * Eigen::Vector3d(0, 0, -options.gravity_mps2);
    preintegrations = preintegrate(bias);
  }
  std::vector<Preintegration> preintegrate(const ImuBias& at) const {
    std::vector<Preintegration> result;
    for (size_t k = 1; k < synthetic.truth.size(); ++k)
      result.emplace_back(synthetic.imu.between(synthetic.truth[k - 1].t, synthetic.truth[k].t), at,
                          noise);
    return result;
  }
  VisualWindow visual(double sigma_px) const {
    return buildVisualWindow(synthetic.calibration, synthetic.keyframes(), sigma_px);
  }
  std::vector<Eigen::Vector3d> landmarksOf(const VisualWindow& window) const {
    std::vector<Eigen::Vector3d> result;
    for (const LandmarkId id : window.landmark_ids) result.push_back(landmarks_V[id]);
    return result;
  }

  SyntheticWindow synthetic;
  ImuBias bias;
  ImuNoiseDensities noise;
  std::vector<SE3> T_VB;
  std::vector<Eigen::Vector3d> v_VB, landmarks_V;
  Eigen::Vector3d g_V;
  std::vector<Preintegration> preintegrations;  ///< at the true biases
};

/** Few landmarks, for what looks at the IMU alone; the run's number is the seed. */
inline SyntheticWindowOptions imuOnly(int run) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.seed = static_cast<unsigned>(3000 + run);
  options.frames_per_keyframe = 1;
  options.landmarks = 1;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  return options;
}

/** The same with tracks of `sigma_px`. */
inline SyntheticWindowOptions withTracks(int run, double sigma_px, int landmarks) {
  SyntheticWindowOptions options = imuOnly(run);
  options.landmarks = landmarks;
  options.sigma_px = options.assumed_sigma_px = sigma_px;
  return options;
}

/** [rotation (right perturbation), position] of keyframes 1.., estimate less truth. */
inline Eigen::VectorXd poseErrors(const std::vector<SE3>& estimate, const std::vector<SE3>& truth) {
  Eigen::VectorXd e(6 * (truth.size() - 1));
  for (size_t k = 1; k < truth.size(); ++k) {
    const Eigen::Index i = 6 * (k - 1);
    e.segment<3>(i) = logSO3(truth[k].R.transpose() * estimate[k].R);
    e.segment<3>(i + 3) = estimate[k].t - truth[k].t;
  }
  return e;
}

}  // namespace etalon::testing
