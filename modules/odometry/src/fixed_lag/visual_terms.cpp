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
inline Eigen::Matrix<double, 6, 1> byTwist(const Eigen::Vector3d& y, double rho,
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
  centre_W_ = window.states.back().linearization.T_WB.t;
  T_NI_.clear();
  for (const WindowState& state : window.states) {
    T_NI_.push_back(state.linearization.T_WB * state.T_BI);
    T_NI_.back().t -= centre_W_;
  }
  views_.place(window);
}

/** What one camera of an observation adds to the sums; false if the landmark is behind it, which adds
 * to the cost alone. */
inline bool VisualTerms::pixelAt(const Window& window, const RelativeViews::Ray& ray, int host,
                                 const LandmarkObservation& o, size_t camera, Pixel* pixel) {
  Eigen::Matrix<double, 2, 3> J_C;
  if (!views_.residual(ray, host, o, camera, &pixel->r, &J_C)) {
    cost_.add(kBehindCamera * kBehindCamera);
    return false;
  }
  const double inverse_variance = 1.0 / window.pixel_variance;
  const RelativeViews::View& from = views_.view(host, o.state, camera);
  pixel->J_T = from.R.transpose() * J_C.transpose();
  pixel->weight = cost_.add(pixel->r.squaredNorm() * inverse_variance) * inverse_variance;
  pixel->by_rho = pixel->J_T.transpose() * (ray.origin - from.c);
  return true;
}

/** Sums over the observations of one landmark. */
void VisualTerms::collect(const Window& window, Landmark* landmark, int last_state) {
  const RelativeViews::Ray ray = views_.ray(*landmark);
  Eliminated e;
  e.landmark = landmark;
  e.first = targets_.size();
  e.rho = ray.rho;
  e.y = ray.ray + e.rho * T_NI_[landmark->host].t;
  calibration_.rows.clear();
  // With A the sums over the residuals of w J^T J, by y, and d = origin - c of the residual's camera,
  // the landmark's derivatives J [axes(0), axes(1), d] need A and A d alone.
  const Eigen::Matrix<double, 3, 2> bearing = ray.axes.leftCols<2>();
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d A_d = Eigen::Vector3d::Zero(), g = Eigen::Vector3d::Zero();
  double d_A_d = 0.0, d_g = 0.0;
  for (const LandmarkObservation& o : landmark->observations) {
    if (o.state > last_state) continue;
    Eigen::Matrix3d JJ = Eigen::Matrix3d::Zero();
    Eigen::Vector3d JJ_d = Eigen::Vector3d::Zero(), Jr = Eigen::Vector3d::Zero();
    for (size_t camera = o.first(); camera < o.end(); ++camera) {
      Pixel pixel;
      if (!pixelAt(window, ray, landmark->host, o, camera, &pixel)) continue;
      const Eigen::Vector2d &r = pixel.r, &by_rho = pixel.by_rho;
      const Eigen::Vector3d j0 = pixel.J_T.col(0), j1 = pixel.J_T.col(1);
      const Eigen::Vector3d w0 = pixel.weight * j0, w1 = pixel.weight * j1;
      for (int i = 0; i < 3; ++i) JJ.col(i) += j0[i] * w0 + j1[i] * w1;
      JJ_d += by_rho[0] * w0 + by_rho[1] * w1;
      Jr += r[0] * w0 + r[1] * w1;
      d_A_d += pixel.weight * by_rho.squaredNorm();
      d_g += pixel.weight * by_rho.dot(r);
      if (!with_calibration_) continue;
      const Eigen::Matrix<double, 2, 3> J = pixel.J_T.transpose();
      Eigen::Matrix<double, 2, 3> J_l;
      J_l << J * bearing, by_rho;
      calibration_.rows.push_back(
          {o.state, pixel.weight, r, J, J_l,
           calibration_.derivatives(camera, o.measurements[camera],
                                    relativePose(window.states[landmark->host].seenFrom(),
                                                 window.states[o.state].seenFrom()),
                                    landmark->in_host)});
    }
    A += JJ;
    A_d += JJ_d;
    g += Jr;
    if (o.state == landmark->host) continue;
    Target& target = targets_.emplace_back();
    target.state = o.state;
    target.JJ = JJ;
    target.JJ_l << JJ * bearing, JJ_d;
    target.Jr = Jr;
  }
  e.last = targets_.size();
  e.g_l << bearing.transpose() * g, d_g;
  Eigen::Matrix3d V;
  V.topLeftCorner<2, 2>().noalias() = bearing.transpose() * (A * bearing);
  V.col(2).head<2>().noalias() = bearing.transpose() * A_d;
  V(2, 2) = d_A_d;
  // At infinity, and the residuals want it farther: its distance is no unknown.
  e.held = !(e.rho > 0.0) && e.g_l.z() >= 0.0;
  const double rho_information = V(2, 2);
  if (e.held) {
    V.col(2) << 0.0, 0.0, 1.0;
    e.g_l.z() = 0.0;
    for (size_t i = e.first; i < e.last; ++i) targets_[i].JJ_l.col(2).setZero();
    for (CalibrationSums::Row& row : calibration_.rows) row.J_landmark.col(2).setZero();
  }
  V.row(2).head<2>() = V.col(2).head<2>().transpose();
  // Without parallax the distance is not determined: it stays where it is.
  const Eigen::Vector3d undamped = V.diagonal();
  V(0, 0) += 1e-9 * V(0, 0) + 1e-12;
  V(1, 1) += 1e-9 * V(1, 1) + 1e-12;
  V(2, 2) += 1e-9 * V(2, 2) + 1e-6;
  e.factor = inverseRoot(V);
  landmark->covariance.noalias() = e.factor * e.factor.transpose();
  if (e.held) landmark->covariance(2, 2) = 1.0 / (rho_information + 1e-6);
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

void VisualTerms::collectGradient(const Window& window, Eliminated* e) {
  const Landmark& landmark = *e->landmark;
  const RelativeViews::Ray ray = views_.ray(landmark);
  e->rho = ray.rho;
  e->y = ray.ray + e->rho * T_NI_[landmark.host].t;
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double d_g = 0.0;
  size_t target = e->first;
  for (const LandmarkObservation& o : landmark.observations) {
    Eigen::Vector3d Jr = Eigen::Vector3d::Zero();
    for (size_t camera = o.first(); camera < o.end(); ++camera) {
      Pixel pixel;
      if (!pixelAt(window, ray, landmark.host, o, camera, &pixel)) continue;
      const Eigen::Vector2d weighted = pixel.weight * pixel.r;
      Jr.noalias() += pixel.J_T * weighted;
      d_g += pixel.by_rho.dot(weighted);
    }
    g += Jr;
    if (o.state != landmark.host) targets_[target++].Jr = Jr;
  }
  e->g_l << ray.axes.leftCols<2>().transpose() * g, e->held ? 0.0 : d_g;
  const Eigen::Vector3d best = e->factor * (e->factor.transpose() * e->g_l);
  for (size_t i = e->first; i < e->last; ++i) {
    const Vector6d by_twist = byTwist(e->y, e->rho, targets_[i].Jr - targets_[i].JJ_l * best);
    g_.segment<6>(6 * targets_[i].state) += by_twist;
    g_.segment<6>(6 * landmark.host) -= by_twist;
  }
}

void VisualTerms::updateGradient(const Window& window, NormalEquations* equations) {
  cost_ = RobustCost();
  g_.setZero();
  placeViews(window);
  for (Eliminated& e : eliminated_) collectGradient(window, &e);
  equations->cost += cost_.total();
  for (size_t k = 0; k < window.states.size(); ++k)
    if (used_[k])
      equations->g.segment<6>(window.states[k].column).noalias() +=
          twistByState(window.states[k], centre_W_).transpose() * g_.segment<6>(6 * k);
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
  const RelativeViews views(window);
  RobustCost cost;
  for (const Landmark* landmark : landmarks) {
    const RelativeViews::Ray ray = views.ray(*landmark);
    for (const LandmarkObservation& o : landmark->observations)
      for (size_t camera = o.first(); camera < o.end(); ++camera) {
        Eigen::Vector2d r;
        const bool ahead = views.residual(ray, landmark->host, o, camera, &r);
        cost.add(ahead ? r.squaredNorm() / window.pixel_variance : kBehindCamera * kBehindCamera);
      }
  }
  return cost.total();
}

}  // namespace etalon::fixed_lag
