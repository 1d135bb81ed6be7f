#include "etalon/frontend/time_offset.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/so3.h"

namespace etalon {

namespace {

// A peak counts as clear from these on: noise and repetitive motion stay below (tests: steps of
// MH_01 shuffled in time reach 0.5), real motion tracked in real images lies above 0.9.
constexpr double kClearCorrelation = 0.8;
constexpr double kClearMargin = 0.1;
constexpr int kMinSteps = 30;
/** Spread of the gyro's rate that is well above its noise, relative to the camera's noise of 1 mrad
 * a step. */
constexpr double kMinAngleSpread = 3e-3;  // rad
/** With less than this share of the rotation about a second axis, the axes cannot be told apart. */
constexpr double kMinSecondAxis = 0.1;
constexpr double kStepS = 2.5e-3;
/** What an offset must add to the correlation, and how many of its standard deviations it must
 * have: errors of the camera's rotations that go with the motion shift the peak without gain. */
constexpr double kMinGain = 5e-3;
constexpr double kMinSigmas = 3.0;

/** Integral of the gyro's rates from the first sample on, at any time in between. */
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<ImuSample>& imu) : imu_(imu) {
    sum_.reserve(imu.size());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < imu.size(); ++i) {
      if (i > 0)
        sum += 0.5 * secondsBetween(imu[i - 1].t, imu[i].t) * (imu[i - 1].gyro + imu[i].gyro);
      sum_.push_back(sum);
    }
  }

  bool covers(TimeNs t) const { return imu_.front().t <= t && t <= imu_.back().t; }

  Eigen::Vector3d at(TimeNs t) const {
    const auto after = std::upper_bound(imu_.begin(), imu_.end(), t,
                                        [](TimeNs v, const ImuSample& s) { return v < s.t; });
    if (after == imu_.end()) return sum_.back();
    const size_t i = after - imu_.begin();
    const double u = secondsBetween(imu_[i - 1].t, t) / secondsBetween(imu_[i - 1].t, imu_[i].t);
    return (1 - u) * sum_[i - 1] + u * sum_[i];
  }

 private:
  const std::vector<ImuSample>& imu_;
  std::vector<Eigen::Vector3d> sum_;
};

struct Comparison {
  double correlation = -2, as_given = -2, mirrored = -2, scale = 0, spread = 0, gyro_spread = 0;
  Eigen::Matrix3d R_CB = Eigen::Matrix3d::Identity();
  double second_axis =
      0;  ///< correlation carried by the second axis of rotation over that of the first
  int steps = 0;
};

Comparison compare(const std::vector<RotationStep>& steps, const GyroIntegral& gyro, TimeNs offset,
                   const Eigen::Matrix3d& given_R_CB) {
  Eigen::Matrix3Xd camera(3, steps.size()), imu(3, steps.size());
  Comparison result;
  for (const RotationStep& step : steps) {
    if (!gyro.covers(step.t0 + offset) || !gyro.covers(step.t1 + offset)) continue;
    camera.col(result.steps) = step.rotation;
    imu.col(result.steps++) = gyro.at(step.t1 + offset) - gyro.at(step.t0 + offset);
  }
  if (result.steps < 3) return result;
  const auto centred = [&](const Eigen::Matrix3Xd& v) -> Eigen::Matrix3Xd {
    return v.leftCols(result.steps).colwise() - v.leftCols(result.steps).rowwise().mean();
  };
  const Eigen::Matrix3Xd c = centred(camera), g = centred(imu);
  const double cc = c.squaredNorm(), gg = g.squaredNorm();
  if (!(cc > 0) || !(gg > 0)) return result;
  // Of all rotations the one nearest to the cross-covariance M maximises trace(R^T M).
  const Eigen::Matrix3d M = c * g.transpose();
  result.R_CB = nearestRotation(M);
  const Eigen::Matrix3d aligned = result.R_CB.transpose() * M;  // symmetric
  result.correlation = aligned.trace() / std::sqrt(cc * gg);
  result.as_given = (given_R_CB.transpose() * M).trace() / std::sqrt(cc * gg);
  const Eigen::Vector3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(aligned, Eigen::EigenvaluesOnly).eigenvalues();
  result.second_axis = axes[1] / axes[2];
  // Of all reflections: the nearest rotation to -M, turned back.
  result.mirrored = -(nearestRotation(-M).transpose() * M).trace() / std::sqrt(cc * gg);
  result.spread = std::sqrt(cc / result.steps);
  result.gyro_spread = std::sqrt(gg / result.steps);
  result.scale = std::sqrt(gg / cc);
  return result;
}

/** Vertex of the parabola through three neighbouring values, in steps from the middle one. */
double vertex(double left, double middle, double right) {
  const double curvature = left - 2 * middle + right;
  return curvature < 0 ? 0.5 * (left - right) / curvature : 0.0;
}

/**
 * Standard deviation of the offset, in steps, from three correlations around the peak: the camera's
 * residual is (1 - c^2) of its 3 n components' power, and what a shift changes is the power times
 * the curvature of c.
 */
double sigmaOfPeak(double left, double middle, double right, int n) {
  const double curvature = left - 2 * middle + right;
  if (!(curvature < 0) || !(middle > 0) || n < 1) return std::numeric_limits<double>::infinity();
  return std::sqrt(std::max(0.0, 1 - middle * middle) / (-3.0 * n * middle * curvature));
}

/** Highest local maximum other than the one at `peak`. */
double otherPeak(const std::vector<double>& values, size_t peak) {
  double other = -1;
  for (size_t i = 1; i + 1 < values.size(); ++i)
    if (i != peak && values[i] >= values[i - 1] && values[i] >= values[i + 1])
      other = std::max(other, values[i]);
  return other;
}

void judge(TimeOffsetEstimate* estimate, bool at_edge) {
  if (estimate->correlation < kClearCorrelation)
    estimate->reason = "gyro and camera rotation hardly correlate";
  else if (at_edge)
    estimate->reason = "the correlation still grows at the end of the search range";
  else if (estimate->correlation - estimate->runner_up < kClearMargin)
    estimate->reason = "the motion is repetitive: several offsets fit";
  estimate->clear = estimate->reason.empty();
}

}  // namespace

bool TimeOffsetEstimate::discernible() const {
  return clear && correlation - correlation_at_zero > kMinGain &&
         std::abs(offset_s) > kMinSigmas * sigma_s;
}

TimeOffsetEstimate estimateTimeOffset(const std::vector<RotationStep>& steps,
                                      const std::vector<ImuSample>& imu, double max_offset_s,
                                      const Eigen::Matrix3d& given_R_CB) {
  TimeOffsetEstimate estimate;
  if (imu.size() < 2 || static_cast<int>(steps.size()) < kMinSteps) {
    estimate.reason = "too few images could be tracked";
    return estimate;
  }
  const GyroIntegral gyro(imu);
  const auto half = static_cast<int>(std::ceil(max_offset_s / kStepS));
  std::vector<Comparison> comparisons;
  std::vector<double> correlations;
  for (int i = -half; i <= half; ++i) {
    comparisons.push_back(compare(steps, gyro, durationNs(i * kStepS), given_R_CB));
    // Offsets at which many steps fall outside the gyro's time rest on other data than the rest:
    // left out.
    const bool enough = comparisons.back().steps >=
                        std::max<int>(kMinSteps, static_cast<int>(steps.size()) * 2 / 3);
    correlations.push_back(enough ? comparisons.back().correlation : -1);
  }
  const size_t peak =
      std::max_element(correlations.begin(), correlations.end()) - correlations.begin();
  const Comparison& best = comparisons[peak];
  if (correlations[peak] <= -1 || best.spread < kMinAngleSpread) {
    estimate.reason = best.spread < kMinAngleSpread
                          ? "the camera hardly changes its rate of rotation"
                          : "images and IMU hardly overlap";
    return estimate;
  }
  const bool at_edge = peak == 0 || peak + 1 == correlations.size();
  const double fraction =
      at_edge ? 0 : vertex(correlations[peak - 1], correlations[peak], correlations[peak + 1]);
  estimate.estimated = true;
  estimate.sigma_s = kStepS * (at_edge ? std::numeric_limits<double>::infinity()
                                       : sigmaOfPeak(correlations[peak - 1], correlations[peak],
                                                     correlations[peak + 1], best.steps));
  estimate.gyro_spread_rad = best.gyro_spread;
  for (size_t i = 0; i < comparisons.size(); ++i) {
    if (!(correlations[i] > -1)) continue;
    estimate.correlation_as_given =
        std::max(estimate.correlation_as_given, comparisons[i].as_given);
    estimate.correlation_mirrored =
        std::max(estimate.correlation_mirrored, comparisons[i].mirrored);
  }
  estimate.offset_s = (static_cast<double>(peak) - half + fraction) * kStepS;
  estimate.correlation = correlations[peak];
  estimate.correlation_at_zero = correlations[half];
  estimate.runner_up = otherPeak(correlations, peak);
  estimate.gyro_scale = best.scale;
  if (best.second_axis > kMinSecondAxis) estimate.R_CB = best.R_CB;
  estimate.steps = best.steps;
  judge(&estimate, at_edge);
  return estimate;
}

}  // namespace etalon
