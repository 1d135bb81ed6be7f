#include "etalon/simulation/recorded_trajectory.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {

namespace {

using Basis = std::array<double, SplineTrajectory::kDegree + 1>;
constexpr Eigen::Index kOrder = SplineTrajectory::kDegree + 1;

/** The degree + 1 non-zero uniform B-spline functions at `u` in [0, 1] of a knot interval (Cox and
 * de Boor). */
Basis basisAt(double u, int degree) {
  Basis n{};
  n[0] = 1.0;
  for (int d = 1; d <= degree; ++d) {
    for (int j = d; j >= 0; --j) {
      const double left = j > 0 ? n[j - 1] : 0.0;
      const double right = j < d ? n[j] : 0.0;
      n[j] = ((u + d - j) * left + (1.0 - u + j) * right) / d;
    }
  }
  return n;
}

/** Weights of the six control points in the `derivative`-th derivative with respect to u (0, 1 or
 * 2). */
Basis derivativeWeights(double u, int derivative) {
  Basis w = basisAt(u, SplineTrajectory::kDegree - derivative);
  for (int pass = 0; pass < derivative; ++pass) {
    // sum_j (c_j+1 - c_j) w_j: the weight of c_j becomes w_j-1 - w_j.
    for (size_t j = w.size() - 1; j > 0; --j) w[j] = w[j - 1] - w[j];
    w[0] = -w[0];
  }
  return w;
}

}  // namespace

SplineTrajectory::SplineTrajectory(const GroundTruth& recorded, double knot_s) : knot_s_(knot_s) {
  if (!(knot_s > 0.0) || recorded.states.size() < 10 ||
      secondsBetween(recorded.states.front().t, recorded.states.back().t) < 10.0 * knot_s) {
    throw ConfigError(
        "a recorded flight to be smoothed needs at least 10 rows and a duration of 10 knots");
  }
  start_ = recorded.states.front().t;
  end_ = recorded.states.back().t;
  fit(recorded);
}

SplineTrajectory::Local SplineTrajectory::locate(TimeNs t) const {
  const double knots = secondsBetween(start_, t) / knot_s_;
  const double last = std::ceil(secondsBetween(start_, end_) / knot_s_) - 1.0;
  const double first = std::clamp(std::floor(knots), 0.0, last);
  return {static_cast<Eigen::Index>(first), knots - first};
}

void SplineTrajectory::fit(const GroundTruth& recorded) {
  // Third differences of the control points, weighted so weakly that they decide only where rows
  // are missing.
  constexpr double kRegularisation = 1e-6;
  const Eigen::Index count = locate(end_).first + kOrder;
  std::vector<Eigen::Triplet<double>> triplets;
  Eigen::Matrix<double, Eigen::Dynamic, 7> rhs =
      Eigen::Matrix<double, Eigen::Dynamic, 7>::Zero(count, 7);
  Eigen::Vector4d last_q = Eigen::Vector4d::Zero();
  for (const StampedState& state : recorded.states) {
    Eigen::Matrix<double, 1, 7> row;
    Eigen::Vector4d q = Eigen::Quaterniond(state.T_WB.R).coeffs();
    if (q.dot(last_q) < 0.0) q = -q;
    last_q = q;
    row << state.T_WB.t.transpose(), q.transpose();
    const Local local = locate(state.t);
    const Basis w = derivativeWeights(local.u, 0);
    for (Eigen::Index i = 0; i < kOrder; ++i) {
      rhs.row(local.first + i) += w[i] * row;
      for (Eigen::Index j = 0; j < kOrder; ++j) {
        triplets.emplace_back(static_cast<int>(local.first + i), static_cast<int>(local.first + j),
                              w[i] * w[j]);
      }
    }
  }
  const std::array<double, 4> third = {-1.0, 3.0, -3.0, 1.0};
  for (Eigen::Index k = 0; k + 4 <= count; ++k) {
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < 4; ++j) {
        triplets.emplace_back(static_cast<int>(k) + static_cast<int>(i),
                              static_cast<int>(k) + static_cast<int>(j),
                              kRegularisation * third[i] * third[j]);
      }
    }
  }
  Eigen::SparseMatrix<double> normal(count, count);
  normal.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  if (solver.info() != Eigen::Success) throw ConfigError("a recorded flight cannot be smoothed");
  control_ = solver.solve(rhs);
}

TrajectoryState SplineTrajectory::at(TimeNs t) const {
  const Local local = locate(std::clamp(t, start_, end_));
  std::array<Eigen::Matrix<double, 1, 7>, 3> value;
  for (int d = 0; d < 3; ++d) {
    const Basis w = derivativeWeights(local.u, d);
    Eigen::Matrix<double, 1, 7> sum = Eigen::Matrix<double, 1, 7>::Zero();
    for (Eigen::Index i = 0; i < kOrder; ++i) {
      sum += w[i] * control_.row(local.first + i);
    }
    value[d] = sum / std::pow(knot_s_, d);
  }
  const auto quaternion = [](const Eigen::Matrix<double, 1, 7>& row) {
    return Eigen::Quaterniond(row[6], row[3], row[4], row[5]);
  };
  const Eigen::Quaterniond q = quaternion(value[0]);
  TrajectoryState state;
  state.t = t;
  state.T_WB = {q.normalized().toRotationMatrix(), value[0].head<3>().transpose()};
  state.v_WB = value[1].head<3>().transpose();
  state.a_W = value[2].head<3>().transpose();
  // omega_B = 2 vec(q^-1 dq/dt); the change of the norm is in the scalar part only.
  state.omega_B = 2.0 * (q.conjugate() * quaternion(value[1])).vec() / q.squaredNorm();
  return state;
}

InterpolatedTrajectory::InterpolatedTrajectory(GroundTruth recorded)
    : recorded_(std::move(recorded)) {
  if (recorded_.states.size() < 2) {
    throw ConfigError("a recorded flight needs at least 2 rows of ground truth");
  }
  start_ = recorded_.states.front().t;
  end_ = recorded_.states.back().t;
}

StampedState InterpolatedTrajectory::row(TimeNs t) const {
  constexpr double kAnyGap = 1e9;  // s
  return recorded_.at(t, kAnyGap).value();
}

TrajectoryState InterpolatedTrajectory::at(TimeNs t) const {
  constexpr TimeNs kHalfStep = 5'000'000;
  const TimeNs inside = std::clamp(t, start_, end_);
  const StampedState now = row(inside);
  const StampedState before = row(std::max(start_, inside - kHalfStep));
  const StampedState after = row(std::min(end_, inside + kHalfStep));
  const double dt = secondsBetween(before.t, after.t);
  TrajectoryState state;
  state.t = t;
  state.T_WB = now.T_WB;
  state.omega_B = logSO3(before.T_WB.R.transpose() * after.T_WB.R) / dt;
  if (recorded_.has_velocity) {
    state.v_WB = now.v_WB;
    state.a_W = (after.v_WB - before.v_WB) / dt;
  } else {
    state.v_WB = (after.T_WB.t - before.T_WB.t) / dt;
    const double first = secondsBetween(before.t, inside), second = secondsBetween(inside, after.t);
    if (first > 0.0 && second > 0.0) {
      state.a_W =
          2.0 * ((after.T_WB.t - now.T_WB.t) / second - (now.T_WB.t - before.T_WB.t) / first) / dt;
    }
  }
  return state;
}

}  // namespace etalon
