#include "etalon/evaluation/gyro_agreement.h"

#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

/** Over longer steps of the ground truth or the IMU, s, the white noise cannot be told from the bias
 * and from vibration between the samples. */
constexpr double kMaxStepS = 0.03;
/** Fewer steps say nothing about a recording. */
constexpr size_t kMinSteps = 100;
/** Median of the absolute value of a standard normal variable. */
constexpr double kMedianOfNormal = 0.6744897501960817;

}  // namespace

GyroAgreement gyroAgreement(const GroundTruth& ground_truth, const std::vector<ImuSample>& imu,
                            const Eigen::Vector3d& bias, double gyro_noise_density) {
  GyroAgreement agreement;
  if (!(gyro_noise_density > 0.0)) return agreement;
  const ImuBuffer buffer(imu);
  const TimeNs margin = durationNs(kMaxStepS);  // so that the samples around a step are seen
  std::vector<double> sizes;
  double squares = 0.0;
  for (size_t k = 1; k < ground_truth.states.size(); ++k) {
    const StampedState &begin = ground_truth.states[k - 1], &end = ground_truth.states[k];
    const double dt = secondsBetween(begin.t, end.t);
    if (dt > kMaxStepS || buffer.longestGap(begin.t - margin, end.t + margin) > kMaxStepS) continue;
    const ImuBias used = {ground_truth.has_biases ? begin.bias.gyro : bias,
                          Eigen::Vector3d::Zero()};
    const Eigen::Matrix3d dR = Preintegration(buffer.between(begin.t, end.t), used, {}).deltas().dR;
    const Eigen::Vector3d difference =
        logSO3(dR.transpose() * begin.T_WB.R.transpose() * end.T_WB.R) /
        (gyro_noise_density * std::sqrt(dt));
    squares += difference.squaredNorm();
    for (int i = 0; i < 3; ++i) sizes.push_back(std::abs(difference[i]));
  }
  if (sizes.size() < 3 * kMinSteps) return agreement;
  agreement.rms = std::sqrt(squares / static_cast<double>(sizes.size()));
  agreement.median = quantile(std::move(sizes), 0.5) / kMedianOfNormal;
  return agreement;
}

}  // namespace etalon
