#include "etalon/evaluation/metrics.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"

namespace etalon {
namespace {

double angleDeg(const Eigen::Matrix3d& R) { return degrees(logSO3(R).norm()); }

/** Root mean square; NaN for an empty set. */
class RmsAccumulator {
 public:
  void add(double squared_error) {
    sum_ += squared_error;
    ++count_;
  }
  double value() const { return count_ == 0 ? WindowErrors::kNone : std::sqrt(sum_ / count_); }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

double rmsRelativeRotationDeg(const std::vector<StampedState>& states,
                              const std::vector<std::optional<StampedState>>& truths) {
  RmsAccumulator rms;
  for (size_t k = 1; k < states.size(); ++k) {
    if (!truths[k - 1] || !truths[k]) continue;
    const Eigen::Matrix3d estimated = states[k - 1].T_WB.R.transpose() * states[k].T_WB.R;
    const Eigen::Matrix3d truth = truths[k - 1]->T_WB.R.transpose() * truths[k]->T_WB.R;
    const double error_deg = angleDeg(truth.transpose() * estimated);
    rms.add(error_deg * error_deg);
  }
  return rms.value();
}

double rmsAlignedDistance(const std::vector<Eigen::Vector3d>& p_G,
                          const std::vector<Eigen::Vector3d>& p_W, const Alignment& alignment) {
  RmsAccumulator rms;
  for (size_t i = 0; i < p_G.size(); ++i) rms.add((p_G[i] - alignment * p_W[i]).squaredNorm());
  return rms.value();
}

}  // namespace

double pathLength(const std::vector<Eigen::Vector3d>& points) {
  double length = 0.0;
  for (size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::optional<bool> WindowErrors::success() const {
  if (std::isnan(gravity_deg) || std::isnan(velocity_mps)) return std::nullopt;
  return gravity_deg < kSuccessGravityDeg && velocity_mps < kSuccessVelocityMps;
}

std::vector<std::string> WindowErrors::outsideClaim() const {
  constexpr double kTail = 4.65e-4;  // of a normal variable beyond 3.5 standard deviations
  std::vector<std::string> outside;
  const auto check = [&outside](const char* name, double nees, double dof) {
    if (dof * nees > chiSquareQuantile(dof, kTail)) outside.emplace_back(name);
  };
  check("tilt", tilt_nees, 2.0);
  check("velocity", velocity_nees, 3.0);
  check("accelerometer bias", accel_bias_nees, 3.0);
  return outside;
}

WindowErrors evaluateWindow(const std::vector<StampedState>& states, const ImuBias& bias,
                            const GroundTruth& ground_truth,
                            const std::optional<Eigen::Vector3d>& gravity_direction_G) {
  std::vector<std::optional<StampedState>> truths;
  for (const StampedState& state : states) truths.push_back(ground_truth.at(state.t));

  WindowErrors errors;
  std::vector<Eigen::Vector3d> p_G, p_W;
  RmsAccumulator velocity;
  ImuBias true_bias;
  for (size_t k = 0; k < states.size(); ++k) {
    if (!truths[k]) continue;
    p_G.push_back(truths[k]->T_WB.t);
    p_W.push_back(states[k].T_WB.t);
    velocity.add((states[k].T_WB.R.transpose() * states[k].v_WB -
                  truths[k]->T_WB.R.transpose() * truths[k]->v_WB)
                     .squaredNorm());
    true_bias.gyro += truths[k]->bias.gyro;
    true_bias.accel += truths[k]->bias.accel;
  }
  errors.keyframes = p_G.size();
  if (p_G.empty()) return errors;

  errors.rre_deg = rmsRelativeRotationDeg(states, truths);
  errors.ate_m = rmsAlignedDistance(p_G, p_W, alignPoints(p_G, p_W, AlignmentType::kSE3));
  errors.ate_yaw_m =
      rmsAlignedDistance(p_G, p_W, alignPoints(p_G, p_W, AlignmentType::kYawPosition));
  if (truths.front()) {
    const Eigen::Vector3d g_W(0.0, 0.0, -1.0);
    const Eigen::Vector3d g_B = states.front().T_WB.R.transpose() * g_W;
    const Eigen::Matrix3d R_BG = truths.front()->T_WB.R.transpose();
    errors.gravity_deg = degrees(angleBetween(g_B, R_BG * g_W));
    if (gravity_direction_G)
      errors.gravity_corrected_deg = degrees(angleBetween(g_B, R_BG * *gravity_direction_G));
  }
  if (ground_truth.has_velocity) errors.velocity_mps = velocity.value();
  if (ground_truth.has_biases) {
    errors.gyro_bias_rps = (bias.gyro - true_bias.gyro / errors.keyframes).norm();
    errors.accel_bias_mps2 = (bias.accel - true_bias.accel / errors.keyframes).norm();
  }
  if (pathLength(p_G) > kMinPathForScale && pathLength(p_W) > 0.0)
    errors.scale_error = std::abs(1.0 - alignPoints(p_G, p_W, AlignmentType::kSim3).scale);
  return errors;
}

ErrorStatistics statisticsOf(std::vector<double> errors) {
  ErrorStatistics statistics;
  statistics.count = errors.size();
  if (errors.empty()) return statistics;
  const auto n = static_cast<double>(errors.size());
  double sum = 0.0;
  statistics.sse = 0.0;
  for (const double e : errors) {
    sum += e;
    statistics.sse += e * e;
  }
  statistics.rmse = std::sqrt(statistics.sse / n);
  statistics.mean = sum / n;
  double spread = 0.0;
  for (const double e : errors) spread += (e - statistics.mean) * (e - statistics.mean);
  statistics.std = std::sqrt(spread / n);
  const auto [min, max] = std::minmax_element(errors.begin(), errors.end());
  statistics.min = *min;
  statistics.max = *max;
  statistics.median = quantile(std::move(errors), 0.5);
  return statistics;
}

}  // namespace etalon
