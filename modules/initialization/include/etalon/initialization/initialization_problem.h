#pragma once

#include <memory>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"
#include "etalon/odometry/visual_solution.h"

namespace etalon {

/**
 * Everything that an initializer may look at: a window of keyframes, the tracks of all frames in
 * it, raw IMU, calibration, priors. A value: immutable once built; copies share the lazily computed
 * visual solution.
 */
class InitializationProblem {
 public:
  struct Data {
    StereoInertialCalibration calibration;
    ImuNoiseDensities imu_noise;  ///< densities to use (data sheet times factors)
    double gravity_mps2 = 9.81;   ///< magnitude
    BiasPriors priors;
    StereoOdometryOptions odometry;     ///< its sigma_px is what is believed of a tracked pixel
    std::vector<TrackedFrame> frames;   ///< all stereo frames of the window, increasing in time
    std::vector<int> keyframe_indices;  ///< into frames, increasing
    ImuBuffer imu;                      ///< covers the window
  };

  /** @throws DataError if keyframe_indices are not increasing indices into frames */
  explicit InitializationProblem(Data data);

  const Data& data() const { return *data_; }
  const StereoInertialCalibration& calibration() const { return data_->calibration; }
  const ImuNoiseDensities& imuNoise() const { return data_->imu_noise; }
  double gravityMagnitude() const { return data_->gravity_mps2; }
  /** Standard deviation of a tracked pixel coordinate, px. */
  double sigmaPx() const { return data_->odometry.sigma_px; }
  const BiasPriors& priors() const { return data_->priors; }
  const std::vector<TrackedFrame>& frames() const { return data_->frames; }
  const ImuBuffer& imu() const { return data_->imu; }

  int keyframeCount() const { return static_cast<int>(data_->keyframe_indices.size()); }
  const TrackedFrame& keyframe(int k) const { return data_->frames[data_->keyframe_indices[k]]; }
  /** All of them, in order; valid as long as the problem. */
  std::vector<const TrackedFrame*> keyframes() const;
  const std::vector<int>& keyframeIndices() const { return data_->keyframe_indices; }

  /** Preintegration between keyframes k-1 and k for every k >= 1, at `bias`: keyframeCount() - 1 of
   * them. */
  std::vector<Preintegration> preintegrate(const ImuBias& bias) const {
    return preintegrate(bias, imuNoise());
  }
  /** The same with other densities. */
  std::vector<Preintegration> preintegrate(const ImuBias& bias,
                                           const ImuNoiseDensities& noise) const;

  /**
   * Stereo odometry over the keyframes, with the gyro's rotations at the priors' mean as a start.
   * Computed at the first call; copies of the problem share it.
   * Refused if a keyframe cannot be located.
   */
  const Expected<VisualSolution>& visualSolution() const;
  /** Whether visualSolution() has been asked for, and how long it took, ms. */
  bool visualSolutionComputed() const;
  double visualSolutionMilliseconds() const;

 private:
  struct Lazy;
  std::shared_ptr<const Data> data_;
  std::shared_ptr<Lazy> lazy_;
};

/** The visual solution; refused (too_few_tracks) with fewer landmarks. Valid as long as the problem.
 */
Expected<const VisualSolution*> visualSolutionWith(const InitializationProblem& problem,
                                                   int min_landmarks);

}  // namespace etalon
