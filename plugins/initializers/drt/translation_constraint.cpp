#include "translation_constraint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "etalon/core/statistics.h"
#include "etalon/optimization/residuals/cauchy.h"

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {
constexpr double kInlier = 4.0;  // standard deviations

/** Adds the part of the block at (row, column) and of its transpose in the lower triangle. */
void addLower(Eigen::Index row, Eigen::Index column, const Matrix3d& block, Eigen::MatrixXd* H) {
  if (row >= column) H->block<3, 3>(row, column) += block;
  if (row <= column) H->block<3, 3>(column, row) += block.transpose();
}

}  // namespace

TranslationConstraint::TranslationConstraint(const StereoInertialCalibration& calibration,
                                             const std::vector<const TrackedFrame*>& keyframes,
                                             const std::vector<Matrix3d>& R_VB, double sigma_px,
                                             double min_parallax_rad)
    : keyframe_count_(keyframes.size()), min_parallax_rad_(min_parallax_rad) {
  std::map<LandmarkId, Landmark> seen;
  for (size_t k = 0; k < keyframes.size(); ++k)
    for (size_t c = 0; c < 2; ++c) {
      const CameraCalibration& camera = calibration.cameras[c];
      const Matrix3d R_VC = R_VB[k] * camera.T_BC.R;
      View view;
      view.keyframe = k;
      view.offset = R_VB[k] * camera.T_BC.t;
      view.sigma_rad = sigma_px / std::sqrt(camera.model.focal().prod());
      for (const Observation& o : keyframes[k]->observations) {
        if (c == 1 && !o.has_right) continue;
        const auto ray = camera.model.unproject(c == 0 ? o.left : o.right);
        if (!ray) continue;
        view.ray = R_VC * ray->normalized();
        seen[o.id].views.push_back(view);
      }
    }
  for (auto& [id, landmark] : seen) {
    const bool moving = landmark.views.front().keyframe != landmark.views.back().keyframe;
    if (!moving) continue;
    chooseStereoBase(&landmark);
    landmarks_.push_back(std::move(landmark));
  }
}

void TranslationConstraint::setBase(size_t a, size_t b, Landmark* landmark) const {
  const Vector3d& d_b = landmark->views[b].ray;
  const Vector3d n = d_b.cross(landmark->views[a].ray);
  landmark->sine = n.norm();
  landmark->a = landmark->b = a;
  if (landmark->sine < min_parallax_rad_) return;
  landmark->b = b;
  landmark->slope = n.cross(d_b) / n.squaredNorm();  // n . (d_b x y) = (n x d_b) . y
}

void TranslationConstraint::chooseStereoBase(Landmark* landmark) const {
  const std::vector<View>& views = landmark->views;
  std::vector<std::pair<double, size_t>> distances;  // distance, index of the left view
  for (size_t i = 0; i + 1 < views.size(); ++i) {
    if (views[i].keyframe != views[i + 1].keyframe) continue;
    const Vector3d n = views[i + 1].ray.cross(views[i].ray);
    const double z =
        n.dot(views[i + 1].ray.cross(views[i + 1].offset - views[i].offset)) / n.squaredNorm();
    if (n.norm() >= min_parallax_rad_ && z > 0.0) distances.emplace_back(z, i);
  }
  if (distances.empty()) return;
  const auto middle = distances.begin() + distances.size() / 2;
  std::nth_element(distances.begin(), middle, distances.end());
  setBase(middle->second, middle->second + 1, landmark);
}

void TranslationConstraint::chooseWidestBases() {
  const double limit = kInlier * std::max(1.0, noise_);
  for (Landmark& landmark : landmarks_) {
    std::vector<size_t> right;
    for (size_t i = 0; i < landmark.views.size(); ++i)
      if (!landmark.hasBase() || landmark.views[i].residual < limit) right.push_back(i);
    double widest = 0.0;
    std::pair<size_t, size_t> base{0, 0};
    for (size_t i = 0; i < right.size(); ++i)
      for (size_t j = i + 1; j < right.size(); ++j) {
        const double squared =
            landmark.views[right[i]].ray.cross(landmark.views[right[j]].ray).squaredNorm();
        if (squared <= widest) continue;
        widest = squared;
        base = {right[i], right[j]};
      }
    if (base.first != base.second) setBase(base.first, base.second, &landmark);
  }
}

double TranslationConstraint::depth(const Landmark& landmark, const std::vector<Vector3d>& p) {
  const View &a = landmark.views[landmark.a], &b = landmark.views[landmark.b];
  return landmark.slope.dot(p[b.keyframe] + b.offset - p[a.keyframe] - a.offset);
}

int TranslationConstraint::landmarks() const {
  return std::count_if(landmarks_.begin(), landmarks_.end(),
                       [](const Landmark& l) { return l.hasBase(); });
}

int TranslationConstraint::fewestViews() const {
  std::vector<int> views(keyframe_count_, 0);
  for (const Landmark& landmark : landmarks_)
    for (const View& view : landmark.views)
      if (landmark.hasBase()) ++views[view.keyframe];
  return *std::min_element(views.begin(), views.end());
}

void TranslationConstraint::reweight(const std::vector<Vector3d>& p, bool robust) {
  constexpr double kMinDistance = 0.2, kMaxDistance = 100.0;  // m
  std::vector<double> sizes;
  for (Landmark& landmark : landmarks_) {
    if (!landmark.hasBase()) continue;
    View& a = landmark.views[landmark.a];
    const View& b = landmark.views[landmark.b];
    a.residual = 0.0;
    const Vector3d c_a = p[a.keyframe] + a.offset;
    const double z = depth(landmark, p);
    const double z_noise = std::clamp(z, kMinDistance, kMaxDistance);
    for (size_t i = 0; i < landmark.views.size(); ++i) {
      if (i == landmark.a) continue;
      View& view = landmark.views[i];
      const Vector3d y = c_a + z * a.ray - p[view.keyframe] - view.offset;
      const double distance = std::clamp(view.ray.dot(y), kMinDistance, kMaxDistance);
      // The noise of the view's own ray, of ray a and of the depth, as seen from the view.
      const double sideways = view.ray.cross(a.ray).norm() / landmark.sine;
      const double of_depth = sideways * std::hypot(a.sigma_rad, b.sigma_rad);
      const double sigma =
          std::hypot(view.sigma_rad * distance, a.sigma_rad * z_noise, of_depth * z_noise);
      view.residual = (y - view.ray.dot(y) * view.ray).norm() / sigma;
      if (z <= 0.0 || view.ray.dot(y) <= 0.0) view.residual = 1e3;  // behind a camera
      view.weight = 1.0 / (sigma * sigma);
      sizes.push_back(view.residual);
    }
  }
  if (sizes.empty()) return;
  noise_ = median(sizes) / kRayleighMedian;
  const double scale = std::max(1.0, noise_);
  if (!robust) return;
  for (Landmark& landmark : landmarks_)
    for (View& view : landmark.views) {
      const double x = view.residual / (kCauchyWidth * scale);
      view.weight /= (1.0 + x * x) * (1.0 + x * x);
    }
}

void TranslationConstraint::addTo(const std::vector<Vector3d>& p, Eigen::MatrixXd* H,
                                  Eigen::VectorXd* g) const {
  for (const Landmark& landmark : landmarks_) {
    if (!landmark.hasBase()) continue;
    const View &a = landmark.views[landmark.a], &b = landmark.views[landmark.b];
    const Vector3d point = p[a.keyframe] + a.offset + depth(landmark, p) * a.ray;
    // d(point) = (I - D) dp_a + D dp_b
    const Matrix3d D = a.ray * landmark.slope.transpose();
    const Matrix3d by_a = Matrix3d::Identity() - D;
    // The projector N N^T = I - d d^T replaces N, because it is its own square.
    Matrix3d P_sum = Matrix3d::Zero();
    Vector3d Py_sum = Vector3d::Zero();
    const Eigen::Index ka = 3 * a.keyframe, kb = 3 * b.keyframe;
    for (size_t i = 0; i < landmark.views.size(); ++i) {
      const View& view = landmark.views[i];
      if (i == landmark.a || !(view.weight > 0.0)) continue;
      const Matrix3d P = view.weight * (Matrix3d::Identity() - view.ray * view.ray.transpose());
      const Vector3d Py = P * (point - p[view.keyframe] - view.offset);
      const Eigen::Index ki = 3 * view.keyframe;
      P_sum += P;
      Py_sum += Py;
      H->block<3, 3>(ki, ki) += P;
      g->segment<3>(ki) -= Py;
      addLower(ki, ka, -P.lazyProduct(by_a), H);
      addLower(ki, kb, -P.lazyProduct(D), H);
    }
    H->block<3, 3>(ka, ka) += by_a.transpose() * P_sum * by_a;
    H->block<3, 3>(kb, kb) += D.transpose() * P_sum * D;
    addLower(ka, kb, by_a.transpose() * P_sum * D, H);
    g->segment<3>(ka) += by_a.transpose() * Py_sum;
    g->segment<3>(kb) += D.transpose() * Py_sum;
  }
}

}  // namespace etalon::plugins
