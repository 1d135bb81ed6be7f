#include "etalon/evaluation/ground_truth_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/core/symmetric.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/imu_limits.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

/** An interval's length may differ from the one asked for by this share of it. */
constexpr double kMaxLengthDeviation = 0.2;
/** Gauss-Newton on the gyro's bias: quadratic, from zero to rounding in three or four. */
constexpr int kBiasIterations = 5;
/** Gravity and accelerometer bias are told apart by rotation alone; the least eigenvalue of the
 * mean of [I, R]^T [I, R] is 1 - cos(a) for a body that leans by +-a. This is a of 0.8 deg. */
constexpr double kMinRotationSpread = 1e-4;

/** A direction of gravity that is known worse than this is no reference for others, deg. */
constexpr double kMaxGravitySigmaDeg = 0.1;

/** An interval between two states of the ground truth, with the IMU between them. */
struct Interval {
  StampedState begin, end;
  Preintegration imu;

  Eigen::Matrix3d rotation() const { return begin.T_WB.R.transpose() * end.T_WB.R; }
};

/** What counts as a gap, by the median step between the samples, s. */
double longestStepOf(const ImuBuffer& imu) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < imu.samples().size(); ++i)
    steps_s.push_back(secondsBetween(imu.samples()[i - 1].t, imu.samples()[i].t));
  return longestImuStep(steps_s.empty() ? 0.0 : 1.0 / median(std::move(steps_s)));
}

/** The IMU from t0 to t1; nothing where it has a gap there. */
std::optional<Preintegration> withoutGap(const ImuBuffer& imu, double longest_step_s, TimeNs t0,
                                         TimeNs t1) {
  if (!imu.covers(t0, t1) || imu.longestGap(t0, t1) > longest_step_s) return std::nullopt;
  return Preintegration(imu.between(t0, t1), ImuBias(), {});
}

/** The state nearest to t. @param states not empty */
const StampedState& nearest(const std::vector<StampedState>& states, TimeNs t) {
  auto after = std::lower_bound(states.begin(), states.end(), t,
                                [](const StampedState& s, TimeNs value) { return s.t < value; });
  if (after == states.end()) return states.back();
  if (after != states.begin() && t - (after - 1)->t < after->t - t) --after;
  return *after;
}

/** Consecutive intervals from state to state: nothing is interpolated in the ground truth, whatever
 * its rate. */
std::vector<Interval> intervalsOf(const GroundTruth& ground_truth,
                                  const std::vector<ImuSample>& samples, double interval_s) {
  const ImuBuffer imu(samples);
  const double longest_step_s = longestStepOf(imu);
  std::vector<Interval> intervals;
  const TimeNs step = durationNs(interval_s);
  const std::vector<StampedState>& states = ground_truth.states;
  const StampedState* begin = &states.front();
  for (TimeNs t = states.front().t + step;
       begin != &states.back() && t <= states.back().t + step / 2; t += step) {
    const StampedState& end = nearest(states, t);
    const double length_s = secondsBetween(begin->t, end.t);
    if (std::abs(length_s - interval_s) <= kMaxLengthDeviation * interval_s)
      if (auto between = withoutGap(imu, longest_step_s, begin->t, end.t))
        intervals.push_back({*begin, end, *std::move(between)});
    // Until the next state is the nearest one, no step finds an interval, and a damaged stamp can be
    // years away: these steps are passed at once.
    if (begin == &end) t += (begin->t + ((begin + 1)->t - begin->t) / 2 - 1 - t) / step * step;
    begin = &end;
  }
  return intervals;
}

/** Moves the intervals' integration to the gyro bias of least squared rotation error, rad/s. */
Eigen::Vector3d fitGyroBias(std::vector<Interval>* intervals) {
  ImuBias bias;
  for (int iteration = 0; iteration < kBiasIterations; ++iteration) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const Interval& interval : *intervals) {
      const Eigen::Vector3d error =
          logSO3(interval.rotation().transpose() * interval.imu.deltas().dR);
      const Eigen::Matrix3d J = rightJacobianInverseSO3(error) * interval.imu.dR_dbg();
      A += J.transpose() * J;
      b -= J.transpose() * error;
    }
    bias.gyro += A.ldlt().solve(b);
    for (Interval& interval : *intervals) interval.imu = interval.imu.reintegrated(bias);
  }
  return bias.gyro;
}

double rotationRmseDeg(const std::vector<Interval>& intervals) {
  double sum = 0.0;
  for (const Interval& interval : intervals)
    sum += logSO3(interval.rotation().transpose() * interval.imu.deltas().dR).squaredNorm();
  return degrees(std::sqrt(sum / static_cast<double>(intervals.size())));
}

using Matrix3x6 = Eigen::Matrix<double, 3, 6>;

/** A (g_G, b_a) = rhs: three equations of one velocity change. */
struct VelocityEquation {
  Matrix3x6 A;
  Eigen::Vector3d rhs;
};

/** v_1 - v_0 = g dt + R_0 (dv + dv_dba b_a). */
VelocityEquation equationOf(const Interval& interval) {
  const Eigen::Matrix3d& R = interval.begin.T_WB.R;
  VelocityEquation equation;
  equation.A << Eigen::Matrix3d::Identity() * interval.imu.dt(), R * interval.imu.dv_dba();
  equation.rhs = interval.end.v_WB - interval.begin.v_WB - R * interval.imu.deltas().dv;
  return equation;
}

/**
 * The same from positions: the difference of the mean velocities of two consecutive intervals a and
 * b, (p_2 - p_1) / dt_b - (p_1 - p_0) / dt_a
 *   = g (dt_a + dt_b) / 2 + R_0 dv_a + R_1 dp_b / dt_b - R_0 dp_a / dt_a.
 */
VelocityEquation equationOf(const Interval& a, const Interval& b) {
  const Eigen::Matrix3d &R_0 = a.begin.T_WB.R, &R_1 = b.begin.T_WB.R;
  const double dt_a = a.imu.dt(), dt_b = b.imu.dt();
  VelocityEquation equation;
  equation.A << Eigen::Matrix3d::Identity() * (0.5 * (dt_a + dt_b)),
      R_0 * a.imu.dv_dba() + R_1 * b.imu.dp_dba() / dt_b - R_0 * a.imu.dp_dba() / dt_a;
  equation.rhs = (b.end.T_WB.t - b.begin.T_WB.t) / dt_b - (a.end.T_WB.t - a.begin.T_WB.t) / dt_a -
                 R_0 * a.imu.deltas().dv - R_1 * b.imu.deltas().dp / dt_b +
                 R_0 * a.imu.deltas().dp / dt_a;
  return equation;
}

/** Least squares of all velocity equations. */
struct GravityFit {
  Eigen::Vector3d gravity_G, accel_bias;  ///< m/s^2
  double direction_sigma_deg = 0.0;       ///< of gravity's direction, as the residuals say
};

std::vector<VelocityEquation> equationsOf(const std::vector<Interval>& intervals,
                                          bool has_velocity) {
  std::vector<VelocityEquation> equations;
  for (size_t i = 0; i < intervals.size(); ++i) {
    if (has_velocity)
      equations.push_back(equationOf(intervals[i]));
    else if (i > 0 && intervals[i - 1].end.t == intervals[i].begin.t)
      equations.push_back(equationOf(intervals[i - 1], intervals[i]));
  }
  return equations;
}

/** Nothing where the motion does not tell gravity from the bias. */
std::optional<GravityFit> fitGravity(const std::vector<VelocityEquation>& equations) {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  double squared_time = 0.0;
  for (const VelocityEquation& equation : equations) {
    A += equation.A.transpose() * equation.A;
    b += equation.A.transpose() * equation.rhs;
    squared_time += equation.A(0, 0) * equation.A(0, 0);
  }
  if (equations.size() < 3) return std::nullopt;
  if (!(symmetricEigenvalues(A / squared_time)[0] > kMinRotationSpread)) return std::nullopt;
  const Eigen::Matrix<double, 6, 1> x = A.ldlt().solve(b);

  double squares = 0.0;
  for (const VelocityEquation& equation : equations)
    squares += (equation.A * x - equation.rhs).squaredNorm();
  const double variance = squares / (3.0 * static_cast<double>(equations.size()) - 6.0);
  const Eigen::Vector3d direction = x.head<3>().normalized();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
  const Eigen::Matrix3d covariance = variance * A.inverse().topLeftCorner<3, 3>();
  GravityFit fit;
  fit.gravity_G = x.head<3>();
  fit.accel_bias = x.tail<3>();
  fit.direction_sigma_deg =
      degrees(std::sqrt((across * covariance * across).trace()) / fit.gravity_G.norm());
  return fit;
}

/** WindowTruthCheck::velocity_step_mps. */
double largestVelocityStep(const std::vector<Interval>& intervals,
                           const Eigen::Vector3d& gravity_G) {
  constexpr size_t kFewest = 3;  // b_a takes away one
  if (intervals.size() < kFewest) return GroundTruthCheck::kNone;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> steps;
  std::vector<Eigen::Matrix3d> by_bias;
  for (const Interval& interval : intervals) {
    const VelocityEquation equation = equationOf(interval);
    steps.push_back(equation.rhs - equation.A.leftCols<3>() * gravity_G);
    by_bias.push_back(equation.A.rightCols<3>());
    A += by_bias.back().transpose() * by_bias.back();
    b += by_bias.back().transpose() * steps.back();
  }
  const Eigen::Vector3d bias = A.ldlt().solve(b);
  double largest = 0.0;
  for (size_t i = 0; i < steps.size(); ++i)
    largest = std::max(largest, (steps[i] - by_bias[i] * bias).norm());
  return largest;
}

}  // namespace

GroundTruthCheck checkGroundTruth(const GroundTruth& ground_truth,
                                  const std::vector<ImuSample>& imu, double interval_s) {
  GroundTruthCheck check;
  check.bias.gyro.setConstant(GroundTruthCheck::kNone);
  check.bias.accel.setConstant(GroundTruthCheck::kNone);
  if (ground_truth.empty() || imu.empty() || !(interval_s > 0.0)) return check;
  std::vector<Interval> intervals = intervalsOf(ground_truth, imu, interval_s);
  if (intervals.empty()) return check;

  check.interval_s = interval_s;
  check.bias.gyro = fitGyroBias(&intervals);
  check.rre_deg = rotationRmseDeg(intervals);
  const auto fit = fitGravity(equationsOf(intervals, ground_truth.has_velocity));
  if (fit && fit->direction_sigma_deg <= kMaxGravitySigmaDeg) {
    check.gravity_direction_G = fit->gravity_G.normalized();
    check.bias.accel = fit->accel_bias;
    check.world_tilt_deg =
        degrees(angleBetween(check.gravity_direction_G, -Eigen::Vector3d::UnitZ()));
  }
  return check;
}

WindowTruthCheck checkWindowTruth(const GroundTruth& ground_truth, const ImuBuffer& imu,
                                  const std::vector<TimeNs>& keyframes,
                                  const Eigen::Vector3d& gravity_G) {
  const double longest_step_s = longestStepOf(imu);
  std::vector<Interval> intervals;
  Eigen::Vector3d stated = Eigen::Vector3d::Zero();  // sum of the ground truth's b_g
  int states = 0;
  for (size_t k = 0; k < keyframes.size(); ++k) {
    const auto end = ground_truth.at(keyframes[k]);
    if (!end) continue;
    stated += end->bias.gyro;
    ++states;
    if (k == 0) continue;
    const auto begin = ground_truth.at(keyframes[k - 1]);
    if (!begin) continue;
    if (auto between = withoutGap(imu, longest_step_s, begin->t, end->t))
      intervals.push_back({*begin, *end, *std::move(between)});
  }
  WindowTruthCheck bound;
  if (intervals.empty()) return bound;
  const Eigen::Vector3d fitted = fitGyroBias(&intervals);
  bound.rre_deg = rotationRmseDeg(intervals);
  if (ground_truth.has_biases) bound.gyro_bias_rps = (fitted - stated / states).norm();
  if (ground_truth.has_velocity)
    bound.velocity_step_mps = largestVelocityStep(intervals, gravity_G);
  return bound;
}

}  // namespace etalon
