#pragma once

#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/ground_truth_bound.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * How the rotations of a ground truth from one of its states to the next differ from the gyro's, in
 * units of the gyro's white noise over the same time. A truth that knows nothing of the gyro
 * differs by that noise at least: 0.71 of it from sample to sample, where a midpoint step averages
 * two, and by its own. NaN where it cannot be found.
 */
struct GyroAgreement {
  double median = GroundTruthBound::kNone;  ///< of the components, over 0.6745: sigma if Gaussian
  double rms = GroundTruthBound::kNone;     ///< jumps of the truth where it was corrected included

  /** Whether the truth's rotations are the gyro's, smoothed. EuRoC as recorded: median 0.08 in
   * every room, that of the gyro's quantisation; rms 0.5 in the machine hall, 2 to 3 in the Vicon
   * rooms, whose corrections are the truth's own. Refined: both 0.1 to 0.4. */
  bool isCopy() const { return median < 0.5 && rms < 1.0; }
};

/**
 * @param bias of the gyro where the ground truth states none, rad/s
 * @param gyro_noise_density rad/s/sqrt(Hz)
 * @param imu increasing in time
 */
GyroAgreement gyroAgreement(const GroundTruth& ground_truth, const std::vector<ImuSample>& imu,
                            const Eigen::Vector3d& bias, double gyro_noise_density);

}  // namespace etalon
