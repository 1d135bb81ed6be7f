#include "etalon/evaluation/time_shift.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/evaluation/trajectory_evaluation.h"

namespace etalon {
namespace {

constexpr size_t kFewestPoses = 30;
constexpr size_t kParts = 10;  ///< of the jackknife
constexpr int kIterations = 8;
constexpr double kHalfStepS = 0.01;  ///< of the difference that gives the velocity
/** Slower than that, RMS, the shift is not determined, m/s. */
constexpr double kLeastSpeed = 0.01;

/** With a smaller share of its information left beside the alignment the shift is not determined.
 * EuRoC's flights have 0.8 and more, any 5 s of them 0.02; a straight flight at a constant 1 m/s has
 * 0.015 if its ground truth has 1 mm of noise at 100 Hz. */
constexpr double kLeastShare = 0.02;

using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Vector7 = Eigen::Matrix<double, 7, 1>;

struct ShiftStep {
  double shift_s = 0.0, share = 0.0;
};

/** Normal equations of [shift, rotation, translation], by parts of the trajectory. */
struct Equations {
  std::array<Matrix7, kParts> A;
  std::array<Vector7, kParts> b;
  double squared_speed = 0.0;
  AssociatedTrajectories pairs;

  /** The shift where the alignment is free, and the share of its information that this leaves: none
   * in straight or circular motion at a constant speed, where alignment and shift are the same. */
  ShiftStep shift(size_t without) const {
    Matrix7 sum = Matrix7::Zero();
    Vector7 rhs = Vector7::Zero();
    for (size_t i = 0; i < kParts; ++i) {
      if (i == without) continue;
      sum += A[i];
      rhs += b[i];
    }
    // On a straight line the rotation about it is not determined: a solution of least norm.
    const Eigen::Matrix<double, 6, 1> coupling = sum.col(0).tail<6>();
    const Eigen::Matrix<double, 6, 1> eliminated =
        sum.bottomRightCorner<6, 6>().completeOrthogonalDecomposition().solve(coupling);
    const double information = sum(0, 0) - eliminated.dot(coupling);
    return {(rhs[0] - eliminated.dot(rhs.tail<6>())) / information, information / sum(0, 0)};
  }
};

Equations equationsAt(const Trajectory& estimate, const GroundTruth& truth, double shift_s) {
  Equations equations;
  std::vector<Eigen::Vector3d> velocities;
  for (const StampedPose& pose : estimate) {
    const TimeNs t = pose.t - durationNs(shift_s);
    const auto at = truth.at(t);
    const auto before = truth.at(t - durationNs(kHalfStepS));
    const auto after = truth.at(t + durationNs(kHalfStepS));
    if (!at || !before || !after) continue;
    equations.pairs.estimate.push_back(pose);
    equations.pairs.reference.push_back({pose.t, at->T_WB});
    velocities.push_back((after->T_WB.t - before->T_WB.t) / (2.0 * kHalfStepS));
  }
  equations.A.fill(Matrix7::Zero());
  equations.b.fill(Vector7::Zero());
  const auto alignment = alignmentOf(equations.pairs, AlignmentType::kSE3);
  const size_t n = velocities.size();
  for (size_t i = 0; alignment && i < n; ++i) {
    const Eigen::Vector3d p = *alignment * equations.pairs.estimate[i].T_WB.t;
    Eigen::Matrix<double, 3, 7> J;  // the truth less the aligned estimate, by the seven
    J << velocities[i], -hat(p), Eigen::Matrix3d::Identity();
    const size_t part = i * kParts / n;
    equations.A[part] += J.transpose() * J;
    equations.b[part] += J.transpose() * (equations.pairs.reference[i].T_WB.t - p);
    equations.squared_speed += velocities[i].squaredNorm() / static_cast<double>(n);
  }
  return equations;
}

}  // namespace

Expected<TimeShift> estimateTimeShift(const Trajectory& estimate, const GroundTruth& ground_truth) {
  TimeShift result;
  Equations equations = equationsAt(estimate, ground_truth, 0.0);
  if (equations.pairs.estimate.size() < kFewestPoses)
    return refuse(RefusalStatus::kInvalidInput, "the ground truth covers ",
                  Value(equations.pairs.estimate.size()), " poses, at least ", Bound(kFewestPoses),
                  " are wanted");
  const double speed = std::sqrt(equations.squared_speed);
  if (speed < kLeastSpeed)
    return refuse(RefusalStatus::kTooLittleMotion, "the ground truth moves at ", Value(speed),
                  " m/s, at least ", Bound(kLeastSpeed), " m/s are wanted");
  const double share = equations.shift(kParts).share;
  if (!(share >= kLeastShare))
    return refuse(RefusalStatus::kTooLittleMotion,
                  "the motion is too even, a shift in time is the same as one in space: ",
                  Value(share), " of its information is left beside the alignment, at least ",
                  Bound(kLeastShare), " is wanted");
  for (int i = 0; i < kIterations; ++i) {
    result.shift_s += equations.shift(kParts).shift_s;
    equations = equationsAt(estimate, ground_truth, result.shift_s);
    if (equations.pairs.estimate.size() < kFewestPoses)
      return refuse(RefusalStatus::kNotConverged, "the shift leads out of the ground truth's time");
  }
  std::array<double, kParts> without;
  double mean = 0.0, squares = 0.0;
  for (size_t part = 0; part < kParts; ++part) {
    without[part] = equations.shift(part).shift_s;
    mean += without[part] / kParts;
  }
  for (const double shift : without) squares += (shift - mean) * (shift - mean);
  result.sigma_s = std::sqrt(squares * (kParts - 1.0) / kParts);

  AssociatedTrajectories unshifted;
  for (const StampedPose& pose : equations.pairs.estimate) {
    const auto at = ground_truth.at(pose.t);
    if (!at) continue;
    unshifted.estimate.push_back(pose);
    unshifted.reference.push_back({pose.t, at->T_WB});
  }
  result.before = absoluteErrors(unshifted, AlignmentType::kSE3);
  result.after = absoluteErrors(equations.pairs, AlignmentType::kSE3);
  return result;
}

}  // namespace etalon
