#include "visual_terms.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"

namespace etalon::fixed_lag {
namespace {

/** A landmark behind a camera costs as much as a pixel that is off by this many sigma. */
constexpr double kBehindCamera = 30.0;

}  // namespace

RelativeJacobians relativeJacobians(const SE3& T_WH, const SE3& T_WT) {
  const SE3 T_HT = relativePose(T_WH, T_WT);
  RelativeJacobians J;
  J.by_target.setIdentity();
  J.by_target.bottomRightCorner<3, 3>() = T_WH.R.transpose();
  J.by_host.setZero();
  J.by_host.topLeftCorner<3, 3>() = -T_HT.R.transpose();
  J.by_host.bottomLeftCorner<3, 3>() = hat(T_HT.t);
  J.by_host.bottomRightCorner<3, 3>() = -T_WH.R.transpose();
  return J;
}

/** d(T_WI)/d(T_WB), right perturbation of the rotations. */
static Eigen::Matrix<double, 6, 6> imageByState(const SE3& T_WB, const SE3& T_BI) {
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Identity();
  J.topLeftCorner<3, 3>() = T_BI.R.transpose();
  J.bottomLeftCorner<3, 3>() = -T_WB.R * hat(T_BI.t);
  return J;
}

RelativeJacobians imageJacobians(const WindowState& host, const WindowState& target) {
  const SE3 &T_WH = host.linearization.T_WB, &T_WT = target.linearization.T_WB;
  RelativeJacobians J = relativeJacobians(T_WH * host.T_BI, T_WT * target.T_BI);
  if (!host.T_BI.t.isZero(0.0)) J.by_host *= imageByState(T_WH, host.T_BI);
  if (!target.T_BI.t.isZero(0.0)) J.by_target *= imageByState(T_WT, target.T_BI);
  return J;
}

void VisualTerms::addResidual(const Window& window, const ReprojectionMeasurement& measurement,
                              int camera, const Landmark& landmark, const SE3& T_HT, Target* target,
                              Eigen::Matrix3d* V, Eigen::Vector3d* g_l) {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_landmark;
  if (!reprojectionResidual(window.T_CB[camera], measurement, T_HT, landmark.in_host, &r,
                            target ? &J_pose : nullptr, &J_landmark)) {
    cost_.add(kBehindCamera * kBehindCamera);
    return;
  }
  const double weight = cost_.add(r.squaredNorm() / window.pixel_variance) / window.pixel_variance;
  const Eigen::Matrix<double, 2, 3> weighted = weight * J_landmark;
  V->noalias() += weighted.transpose() * J_landmark;
  g_l->noalias() += weighted.transpose() * r;
  if (with_calibration_)
    calibration_.rows.push_back({target ? target->state : -1, weight, r, J_pose, J_landmark,
                                 calibration_.derivatives(static_cast<size_t>(camera), measurement,
                                                          T_HT, landmark.in_host)});
  if (!target) return;
  const Eigen::Matrix<double, 2, 6> weighted_pose = weight * J_pose;
  target->H_pp.noalias() += weighted_pose.transpose() * J_pose;
  target->H_pl.noalias() += weighted_pose.transpose() * J_landmark;
  target->g_p.noalias() += weighted_pose.transpose() * r;
}

/** Sums over the observations of one landmark. */
void VisualTerms::collect(const Window& window, Landmark* landmark, int last_state) {
  Eliminated e;
  e.landmark = landmark;
  e.first = targets_.size();
  e.g_l.setZero();
  calibration_.rows.clear();
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  const size_t n = window.states.size();
  for (const LandmarkObservation& o : landmark->observations) {
    if (o.state > last_state) continue;
    Target* target = nullptr;
    if (o.state != landmark->host) {
      targets_.emplace_back();
      target = &targets_.back();
      target->state = o.state;
      target->H_pp.setZero();
      target->H_pl.setZero();
      target->g_p.setZero();
    }
    const SE3& T_HT = relative_[landmark->host * n + o.state];
    for (size_t camera = o.first(); camera < o.end(); ++camera)
      addResidual(window, o.measurements[camera], static_cast<int>(camera), *landmark, T_HT, target,
                  &V, &e.g_l);
  }
  e.last = targets_.size();
  // At infinity, and the residuals want it farther: its distance is no unknown.
  const bool held = !(landmark->in_host.parameters.z() > 0.0) && e.g_l.z() >= 0.0;
  if (held) {
    V.row(2).setZero();
    V.col(2).setZero();
    V(2, 2) = 1.0;
    e.g_l.z() = 0.0;
    for (size_t i = e.first; i < e.last; ++i) targets_[i].H_pl.col(2).setZero();
    for (CalibrationSums::Row& row : calibration_.rows) row.J_landmark.col(2).setZero();
  }
  // Without parallax the distance is not determined: it stays where it is.
  const Eigen::Vector3d undamped = V.diagonal();
  V(0, 0) += 1e-9 * V(0, 0) + 1e-12;
  V(1, 1) += 1e-9 * V(1, 1) + 1e-12;
  V(2, 2) += 1e-9 * V(2, 2) + 1e-6;
  e.inverse = V.inverse();
  landmark->covariance = e.inverse;
  eliminated_.push_back(e);
  if (with_calibration_) eliminateFromCalibration(V.diagonal() - undamped);
}

void VisualTerms::HostSums::clear(size_t states) {
  seen_.clear();
  is_seen_.assign(states, 0);
  H_.resize(states * (states + 1) / 2);
  g_.resize(states);
}

void VisualTerms::HostSums::see(int state) {
  if (is_seen_[state]) return;
  is_seen_[state] = 1;
  seen_.push_back(state);
  g_[state].setZero();
  for (const int other : seen_) H(std::min(state, other), std::max(state, other)).setZero();
}

/** The landmark's Schur complement, added to its host's sums. */
void VisualTerms::eliminate(const Eliminated& e) {
  HostSums& sums = hosts_[e.landmark->host];
  const Eigen::Vector3d best = e.inverse * e.g_l;
  for (size_t i = e.first; i < e.last; ++i) {
    Target& a = targets_[i];
    a.scaled.noalias() = a.H_pl * e.inverse;
    sums.see(a.state);
    sums.H(a.state, a.state) += a.H_pp;
    sums.g(a.state) += a.g_p;
    sums.g(a.state).noalias() -= a.H_pl * best;
    for (size_t j = e.first; j <= i; ++j)  // in time order: j's block stands above
      sums.H(targets_[j].state, a.state).noalias() -=
          targets_[j].scaled.lazyProduct(a.H_pl.transpose());
  }
}

/** Adds block, its derivatives being by where images were taken, in terms of the states' poses. */
static void addBlock(const WindowState& a, const WindowState& b, Eigen::Matrix<double, 6, 6> block,
                     Eigen::MatrixXd* H) {
  if (!a.T_BI.t.isZero(0.0)) block = imageByState(a.linearization.T_WB, a.T_BI).transpose() * block;
  if (!b.T_BI.t.isZero(0.0)) block *= imageByState(b.linearization.T_WB, b.T_BI);
  H->block<6, 6>(a.column, b.column) += block;
  if (a.column != b.column) H->block<6, 6>(b.column, a.column) += block.transpose();
}

static void addGradient(const WindowState& a, Eigen::Matrix<double, 6, 1> g, Eigen::VectorXd* sum) {
  if (!a.T_BI.t.isZero(0.0)) g = imageByState(a.linearization.T_WB, a.T_BI).transpose() * g;
  sum->segment<6>(a.column) += g;
}

/**
 * The derivative by a target's pose is T = diag(I, R_WH^T), the same for all of them, and that by
 * the host's is T M_k with M_k = [L_k, (0; -I)], L_k of 6 x 3: with B = T^T H T the blocks are
 * B_kl, (B M)_k and M^T B M.
 */
void VisualTerms::toAbsolute(const Window& window, int host, NormalEquations* equations) const {
  const HostSums& sums = hosts_[host];
  const size_t n = window.states.size();
  const WindowState& h = window.states[host];
  const SE3 T_WH = h.linearization.T_WB * h.T_BI;
  const Eigen::Matrix3d R_HW = T_WH.R.transpose();
  std::vector<Matrix63d> L(n);
  std::vector<Matrix6d> by_host(n, Matrix6d::Zero());  // (B M)_k
  std::vector<int> seen = sums.seen();
  std::sort(seen.begin(), seen.end());
  for (const int k : seen) {
    const WindowState& target = window.states[k];
    const RelativeJacobians J = relativeJacobians(T_WH, target.linearization.T_WB * target.T_BI);
    L[k].topRows<3>() = J.by_host.topLeftCorner<3, 3>();
    L[k].bottomRows<3>().noalias() = T_WH.R * J.by_host.bottomLeftCorner<3, 3>();
  }
  const auto addTimesM = [&](const Matrix6d& block, int l, Matrix6d* sum) {
    sum->leftCols<3>().noalias() += block * L[l];
    sum->rightCols<3>() -= block.rightCols<3>();
  };
  Matrix6d of_host = Matrix6d::Zero();
  Vector6d g_host = Vector6d::Zero();
  for (size_t i = 0; i < seen.size(); ++i) {
    const int k = seen[i];
    for (size_t j = i; j < seen.size(); ++j) {
      const int l = seen[j];
      Matrix6d block = sums.H(k, l);
      block.rightCols<3>() *= R_HW;
      block.bottomRows<3>() = T_WH.R * block.bottomRows<3>().eval();
      addBlock(window.states[k], window.states[l], block, &equations->H);
      addTimesM(block, l, &by_host[k]);
      if (l != k) addTimesM(block.transpose(), k, &by_host[l]);
    }
    addBlock(window.states[k], h, by_host[k], &equations->H);
    of_host.topRows<3>().noalias() += L[k].transpose() * by_host[k];
    of_host.bottomRows<3>() -= by_host[k].bottomRows<3>();
    Vector6d g = sums.g(k);
    g.tail<3>() = T_WH.R * g.tail<3>().eval();
    g_host.head<3>().noalias() += L[k].transpose() * g;
    g_host.tail<3>() -= g.tail<3>();
    addGradient(window.states[k], g, &equations->g);
  }
  addBlock(h, h, of_host, &equations->H);
  addGradient(h, g_host, &equations->g);
}

void VisualTerms::linearize(const Window& window, const std::vector<Landmark*>& landmarks,
                            int last_state, NormalEquations* equations, bool calibration) {
  const size_t n = window.states.size();
  with_calibration_ = calibration;
  if (calibration) beginCalibration(window);
  targets_.clear();
  eliminated_.clear();
  hosts_.resize(n);
  for (HostSums& sums : hosts_) sums.clear(n);
  relative_.resize(n * n);
  for (size_t h = 0; h < n; ++h)
    for (size_t k = 0; k < n; ++k)
      relative_[h * n + k] =
          h == k ? SE3() : relativePose(window.states[h].seenFrom(), window.states[k].seenFrom());
  cost_ = RobustCost();
  for (Landmark* landmark : landmarks) collect(window, landmark, last_state);
  equations->cost += cost_.total();
  for (const Eliminated& e : eliminated_) eliminate(e);
  for (size_t h = 0; h < n; ++h) {
    if (!hosts_[h].used()) continue;
    toAbsolute(window, static_cast<int>(h), equations);
    if (calibration) calibrationToAbsolute(window, static_cast<int>(h), equations);
  }
  if (calibration) finishCalibration(equations);
}

void VisualTerms::solveLandmarks(const Window& window, const Eigen::VectorXd& step) const {
  const size_t n = window.states.size();
  std::vector<Vector6d> relative(n * n);
  for (size_t h = 0; h < n; ++h) {
    if (!hosts_[h].used()) continue;
    for (size_t k = 0; k < n; ++k) {
      if (h == k) continue;
      const WindowState &a = window.states[h], &b = window.states[k];
      const RelativeJacobians J = imageJacobians(a, b);
      relative[h * n + k] =
          J.by_target * step.segment<6>(b.column) + J.by_host * step.segment<6>(a.column);
      if (with_calibration_) relative[h * n + k] += byTimeOffset(a, b) * step[kTimeOffset];
    }
  }
  for (size_t l = 0; l < eliminated_.size(); ++l) {
    const Eliminated& e = eliminated_[l];
    Eigen::Vector3d g = e.g_l;
    if (with_calibration_)
      g.noalias() += calibration_.H_cl[l].transpose() * step.head<kCalibrationSize>();
    for (size_t i = e.first; i < e.last; ++i) {
      const size_t pair = e.landmark->host * n + targets_[i].state;
      g.noalias() += targets_[i].H_pl.transpose() * relative[pair];
    }
    Eigen::Vector3d& parameters = e.landmark->in_host.parameters;
    parameters.noalias() -= e.inverse * g;
    parameters.z() = std::max(0.0, parameters.z());
  }
}

double VisualTerms::cost(const Window& window, const std::vector<Landmark*>& landmarks) const {
  RobustCost cost;
  const size_t n = window.states.size();
  std::vector<SE3> relative(n);
  for (size_t h = 0; h < n; ++h) {
    for (size_t k = 0; k < n; ++k)
      relative[k] = relativePose(window.states[h].seenFrom(), window.states[k].seenFrom());
    for (const Landmark* landmark : landmarks) {
      if (landmark->host != static_cast<int>(h)) continue;
      for (const LandmarkObservation& o : landmark->observations)
        for (size_t camera = o.first(); camera < o.end(); ++camera) {
          Eigen::Vector2d r;
          const bool ahead = reprojectionResidual(window.T_CB[camera], o.measurements[camera],
                                                  relative[o.state], landmark->in_host, &r);
          const double r2 =
              ahead ? r.squaredNorm() / window.pixel_variance : kBehindCamera * kBehindCamera;
          cost.add(r2);
        }
    }
  }
  return cost.total();
}

}  // namespace etalon::fixed_lag
