#include "visual_terms.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/inverse_root.h"
#include "etalon/core/so3.h"

namespace etalon::fixed_lag {
namespace {

/** A landmark behind a camera costs as much as a pixel that is off by this many sigma. */
constexpr double kBehindCamera = 30.0;

/** G^T v = [v x y; -rho v]. */
Eigen::Matrix<double, 6, 1> byTwist(const Eigen::Vector3d& y, double rho,
                                    const Eigen::Vector3d& v) {
  Eigen::Matrix<double, 6, 1> all;
  all << v.cross(y), -rho * v;
  return all;
}

}  // namespace

Eigen::Matrix<double, 6, 6> twistByState(const WindowState& state,
                                         const Eigen::Vector3d& centre_W) {
  const SE3& T_WB = state.linearization.T_WB;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Identity();
  J.topLeftCorner<3, 3>() = T_WB.R;
  J.bottomLeftCorner<3, 3>().noalias() = hat(T_WB.t - centre_W) * T_WB.R;
  return J;
}

void VisualTerms::placeViews(const Window& window) {
  const size_t n = window.states.size();
  centre_W_ = window.states.back().linearization.T_WB.t;
  T_NI_.resize(n);
  views_.resize(2 * n * n);
  std::vector<std::array<SE3, 2>> T_WC(n);
  for (size_t k = 0; k < n; ++k) {
    T_NI_[k] = window.states[k].linearization.T_WB * window.states[k].T_BI;
    T_NI_[k].t -= centre_W_;
    for (size_t c = 0; c < 2; ++c)
      T_WC[k][c] = window.states[k].seenFrom() * window.T_CB[c].inverse();
  }
  for (size_t h = 0; h < n; ++h) {
    // By how much the host's estimate is turned against its linearisation point.
    const SE3 T_WH = window.states[h].seenFrom();
    const Eigen::Matrix3d turned = T_WH.R * T_NI_[h].R.transpose();
    for (size_t k = 0; k < n; ++k)
      for (size_t c = 0; c < 2; ++c) {
        View& view = views_[(h * n + k) * 2 + c];
        view.R.noalias() = T_WC[k][c].R.transpose() * turned;
        view.c.noalias() = turned.transpose() * (T_WC[k][c].t - T_WH.t);
      }
  }
}

/** Sums over the observations of one landmark. */
void VisualTerms::collect(const Window& window, Landmark* landmark, int last_state) {
  Eliminated e;
  e.landmark = landmark;
  e.first = targets_.size();
  e.rho = landmark->in_host.parameters.z();
  e.g_l.setZero();
  calibration_.rows.clear();
  const SE3& T_NH = T_NI_[landmark->host];
  const Eigen::Matrix3d axes = T_NH.R * landmark->in_host.axes;
  const Eigen::Vector3d origin = T_NH.R * landmark->in_host.origin;
  const Eigen::Vector3d from_host =
      axes * landmark->in_host.parameters.head<2>().homogeneous() + e.rho * origin;
  e.y = from_host + e.rho * T_NH.t;
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  for (const LandmarkObservation& o : landmark->observations) {
    if (o.state > last_state) continue;
    Target* target = nullptr;
    if (o.state != landmark->host) {
      targets_.emplace_back();
      target = &targets_.back();
      target->state = o.state;
      target->JJ.setZero();
      target->JJ_l.setZero();
      target->Jr.setZero();
    }
    for (size_t camera = o.first(); camera < o.end(); ++camera) {
      const View& from = view(landmark->host, o.state, camera);
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J_C;
      if (!reprojectionResidual(o.measurements[camera], from.R * (from_host - e.rho * from.c),
                                e.rho, &r, &J_C)) {
        cost_.add(kBehindCamera * kBehindCamera);
        continue;
      }
      const Eigen::Matrix<double, 2, 3> J = J_C * from.R;
      Eigen::Matrix<double, 2, 3> J_l;
      J_l.leftCols<2>().noalias() = J * axes.leftCols<2>();
      J_l.col(2).noalias() = J * (origin - from.c);
      const double weight =
          cost_.add(r.squaredNorm() / window.pixel_variance) / window.pixel_variance;
      const Eigen::Matrix<double, 2, 3> weighted_l = weight * J_l;
      V.noalias() += weighted_l.transpose() * J_l;
      e.g_l.noalias() += weighted_l.transpose() * r;
      if (with_calibration_)
        calibration_.rows.push_back(
            {o.state, weight, r, J, J_l,
             calibration_.derivatives(camera, o.measurements[camera],
                                      relativePose(window.states[landmark->host].seenFrom(),
                                                   window.states[o.state].seenFrom()),
                                      landmark->in_host)});
      if (!target) continue;
      const Eigen::Matrix<double, 2, 3> weighted = weight * J;
      target->JJ.noalias() += weighted.transpose() * J;
      target->JJ_l.noalias() += J.transpose() * weighted_l;
      target->Jr.noalias() += weighted.transpose() * r;
    }
  }
  e.last = targets_.size();
  // At infinity, and the residuals want it farther: its distance is no unknown.
  const bool held = !(e.rho > 0.0) && e.g_l.z() >= 0.0;
  if (held) {
    V.row(2).setZero();
    V.col(2).setZero();
    V(2, 2) = 1.0;
    e.g_l.z() = 0.0;
    for (size_t i = e.first; i < e.last; ++i) targets_[i].JJ_l.col(2).setZero();
    for (CalibrationSums::Row& row : calibration_.rows) row.J_landmark.col(2).setZero();
  }
  // Without parallax the distance is not determined: it stays where it is.
  const Eigen::Vector3d undamped = V.diagonal();
  V(0, 0) += 1e-9 * V(0, 0) + 1e-12;
  V(1, 1) += 1e-9 * V(1, 1) + 1e-12;
  V(2, 2) += 1e-9 * V(2, 2) + 1e-6;
  e.factor = inverseRoot(V);
  landmark->covariance.noalias() = e.factor * e.factor.transpose();
  eliminated_.push_back(e);
  if (with_calibration_) eliminateFromCalibration(V.diagonal() - undamped);
}

/** Adds the landmarks of a host, from eliminated_[first] on, to the equations of the twists: their
 * Schur complements are one product, over the states that see them. */
void VisualTerms::eliminate(int host, size_t first) {
  std::vector<int> seen, place(T_NI_.size(), -1);
  for (size_t i = eliminated_[first].first; i < targets_.size(); ++i) {
    int& at = place[targets_[i].state];
    if (at >= 0) continue;
    at = static_cast<int>(seen.size());
    seen.push_back(targets_[i].state);
  }
  if (seen.empty()) return;
  const Eigen::Index n = 6 * static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd mixed = Eigen::MatrixXd::Zero(n, 3 * (eliminated_.size() - first));
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (size_t l = first; l < eliminated_.size(); ++l) {
    const Eliminated& e = eliminated_[l];
    const Eigen::Matrix3d hat_y = hat(e.y);
    const Eigen::Vector3d best = e.factor * (e.factor.transpose() * e.g_l);
    for (size_t i = e.first; i < e.last; ++i) {
      const Target& target = targets_[i];
      const Eigen::Index at = 6 * place[target.state];
      g.segment<6>(at) += byTwist(e.y, e.rho, target.Jr - target.JJ_l * best);
      const Eigen::Matrix3d scaled = target.JJ_l * e.factor;
      mixed.block<3, 3>(at, 3 * (l - first)).noalias() = -hat_y * scaled;
      mixed.block<3, 3>(at + 3, 3 * (l - first)) = -e.rho * scaled;
      const Eigen::Matrix3d turned = hat_y * target.JJ;  // the lower triangle of G^T JJ G
      H.block<3, 3>(at, at).noalias() -= turned * hat_y;
      H.block<3, 3>(at + 3, at) += e.rho * turned.transpose();
      H.block<3, 3>(at + 3, at + 3) += e.rho * e.rho * target.JJ;
    }
  }
  H.selfadjointView<Eigen::Lower>().rankUpdate(mixed, -1.0);
  H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
  // The host's twist counts against those of all that see its landmarks.
  const Eigen::Index h = 6 * host;
  used_[host] = 1;
  Matrix6d of_host = Matrix6d::Zero();
  for (size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Index a = 6 * seen[i];
    used_[seen[i]] = 1;
    Matrix6d with_host = Matrix6d::Zero();
    for (size_t j = 0; j < seen.size(); ++j) {
      const auto block = H.block<6, 6>(6 * i, 6 * j);
      H_.block<6, 6>(a, 6 * seen[j]) += block;
      with_host -= block;
    }
    H_.block<6, 6>(a, h) += with_host;
    H_.block<6, 6>(h, a) += with_host.transpose();
    of_host -= with_host;
    g_.segment<6>(a) += g.segment<6>(6 * i);
    g_.segment<6>(h) -= g.segment<6>(6 * i);
  }
  H_.block<6, 6>(h, h) += of_host;
}

void VisualTerms::addToStates(const Window& window, NormalEquations* equations) const {
  const size_t n = window.states.size();
  std::vector<Matrix6d> J(n);
  for (size_t k = 0; k < n; ++k)
    if (used_[k]) J[k] = twistByState(window.states[k], centre_W_);
  for (size_t k = 0; k < n; ++k) {
    if (!used_[k]) continue;
    const Eigen::Index a = window.states[k].column;
    equations->g.segment<6>(a).noalias() += J[k].transpose() * g_.segment<6>(6 * k);
    for (size_t l = k; l < n; ++l) {
      if (!used_[l]) continue;
      const Eigen::Index b = window.states[l].column;
      const Matrix6d right = H_.block<6, 6>(6 * k, 6 * l) * J[l];
      const Matrix6d block = J[k].transpose() * right;
      equations->H.block<6, 6>(a, b) += block;
      if (l != k) equations->H.block<6, 6>(b, a) += block.transpose();
    }
  }
}

void VisualTerms::linearize(const Window& window, const std::vector<Landmark*>& landmarks,
                            int last_state, NormalEquations* equations, bool calibration) {
  const auto n = static_cast<Eigen::Index>(window.states.size());
  std::vector<Landmark*> by_host = landmarks;
  std::stable_sort(by_host.begin(), by_host.end(),
                   [](const Landmark* a, const Landmark* b) { return a->host < b->host; });
  targets_.clear();
  eliminated_.clear();
  cost_ = RobustCost();
  H_.setZero(6 * n, 6 * n);
  g_.setZero(6 * n);
  used_.assign(n, 0);
  placeViews(window);
  with_calibration_ = calibration;
  if (calibration) beginCalibration(window);
  size_t first = 0;
  for (size_t i = 0; i < by_host.size(); ++i) {
    collect(window, by_host[i], last_state);
    if (i + 1 < by_host.size() && by_host[i + 1]->host == by_host[i]->host) continue;
    eliminate(by_host[i]->host, first);
    first = eliminated_.size();
  }
  equations->cost += cost_.total();
  addToStates(window, equations);
  if (calibration) addCalibration(window, equations);
}

void VisualTerms::solveLandmarks(const Window& window, const Eigen::VectorXd& step) const {
  const size_t n = window.states.size();
  Eigen::VectorXd twists(6 * n);
  for (size_t k = 0; k < n; ++k)
    twists.segment<6>(6 * k) =
        twistByState(window.states[k], centre_W_) * step.segment<6>(window.states[k].column);
  if (with_calibration_) twists += twistsByTimeOffset(window) * step[kTimeOffset];
  for (size_t l = 0; l < eliminated_.size(); ++l) {
    const Eliminated& e = eliminated_[l];
    Eigen::Vector3d g = e.g_l;
    if (with_calibration_)
      g.noalias() += calibration_.H_cl[l].transpose() * step.head<kCalibrationSize>();
    const Vector6d host = twists.segment<6>(6 * e.landmark->host);
    for (size_t i = e.first; i < e.last; ++i) {
      const Vector6d relative = twists.segment<6>(6 * targets_[i].state) - host;
      g.noalias() += targets_[i].JJ_l.transpose() *
                     (e.y.cross(relative.head<3>()) - e.rho * relative.tail<3>());
    }
    Eigen::Vector3d& parameters = e.landmark->in_host.parameters;
    parameters.noalias() -= e.factor * (e.factor.transpose() * g);
    if (parameters.z() < 0.0) parameters = withThird(parameters, 0.0, e.factor);
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
