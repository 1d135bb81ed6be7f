#include "translation_constraint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TranslationConstraint::TranslationConstraint(const StereoInertialCalibration& calibration,
                                             const std::vector<const TrackedFrame*>& keyframes,
                                             const std::vector<Matrix3d>& R_VB, double sigma_px,
                                             double min_parallax_rad)
    : keyframe_count_(static_cast<int>(keyframes.size())) {
  const PinholeRadtan& left = calibration.cameras[0].model;
  sigma_rad_ = sigma_px / std::sqrt(left.fu * left.fv);
  std::map<LandmarkId, Landmark> seen;
  for (size_t k = 0; k < keyframes.size(); ++k)
    for (size_t c = 0; c < 2; ++c) {
      const CameraCalibration& camera = calibration.cameras[c];
      const Matrix3d R_VC = R_VB[k] * camera.T_BC.R;
      View view;
      view.keyframe = static_cast<int>(k);
      view.offset = R_VB[k] * camera.T_BC.t;
      for (const Observation& o : keyframes[k]->observations) {
        if (c == 1 && !o.has_right) continue;
        const auto xy = camera.model.pixelToNormalized(c == 0 ? o.left : o.right);
        if (!xy) continue;
        view.ray = R_VC * xy->homogeneous().normalized();
        seen[o.id].views.push_back(view);
      }
    }
  for (auto& [id, landmark] : seen) {
    const bool moving = landmark.views.front().keyframe != landmark.views.back().keyframe;
    if (moving && chooseBase(min_parallax_rad, &landmark)) landmarks_.push_back(landmark);
  }
}

bool TranslationConstraint::chooseBase(double min_parallax_rad, Landmark* landmark) {
  const std::vector<View>& views = landmark->views;
  for (size_t a = 0; a < views.size(); ++a)
    for (size_t b = a + 1; b < views.size(); ++b) {
      const double sine = views[a].ray.cross(views[b].ray).norm();
      if (sine <= landmark->sine) continue;
      landmark->sine = sine;
      landmark->a = a;
      landmark->b = b;
    }
  if (landmark->sine < min_parallax_rad) return false;
  const Vector3d& d_b = views[landmark->b].ray;
  const Vector3d n = d_b.cross(views[landmark->a].ray);
  landmark->slope = n.cross(d_b) / n.squaredNorm();  // n . (d_b x y) = (n x d_b) . y
  return true;
}

double TranslationConstraint::depth(const Landmark& landmark, const std::vector<Vector3d>& p) {
  const View &a = landmark.views[landmark.a], &b = landmark.views[landmark.b];
  return landmark.slope.dot(p[static_cast<size_t>(b.keyframe)] + b.offset -
                            p[static_cast<size_t>(a.keyframe)] - a.offset);
}

int TranslationConstraint::fewestRows() const {
  std::vector<int> rows(static_cast<size_t>(keyframe_count_), 0);
  for (const Landmark& landmark : landmarks_)
    for (const View& view : landmark.views) ++rows[static_cast<size_t>(view.keyframe)];
  return *std::min_element(rows.begin(), rows.end());
}

void TranslationConstraint::reweight(const std::vector<Vector3d>& p, bool robust) {
  constexpr double kMinDistance = 0.2, kMaxDistance = 100.0;  // m
  constexpr double kCauchyWidth = 2.385;                      // 95 % efficient on normal residuals
  std::vector<double> sizes;
  for (Landmark& landmark : landmarks_) {
    const View& a = landmark.views[landmark.a];
    const Vector3d c_a = p[static_cast<size_t>(a.keyframe)] + a.offset;
    const double z = depth(landmark, p);
    const double z_noise = std::clamp(z, kMinDistance, kMaxDistance);
    for (size_t i = 0; i < landmark.views.size(); ++i) {
      if (i == landmark.a) continue;
      View& view = landmark.views[i];
      const Vector3d y = c_a + z * a.ray - p[static_cast<size_t>(view.keyframe)] - view.offset;
      const double distance = std::clamp(view.ray.dot(y), kMinDistance, kMaxDistance);
      // The noise of the view's own ray, of ray a, and of the depth, seen from the view.
      const double sideways = view.ray.cross(a.ray).norm() / landmark.sine;
      const double sigma =
          sigma_rad_ *
          std::sqrt(distance * distance + z_noise * z_noise * (1.0 + 2.0 * sideways * sideways));
      view.residual = (y - view.ray.dot(y) * view.ray).norm() / sigma;
      if (z <= 0.0 || view.ray.dot(y) <= 0.0) view.residual = 1e3;  // behind a camera
      view.weight = 1.0 / (sigma * sigma);
      sizes.push_back(view.residual);
    }
  }
  if (sizes.empty()) return;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  noise_ = *middle / 1.17741;  // the median of a two-dimensional normal distribution's norm
  const double scale = std::max(1.0, noise_);
  inlier_share_ = static_cast<double>(std::count_if(sizes.begin(), sizes.end(),
                                                    [&](double r) { return r < 4.0 * scale; })) /
                  static_cast<double>(sizes.size());
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
    const View &a = landmark.views[landmark.a], &b = landmark.views[landmark.b];
    const Vector3d point =
        p[static_cast<size_t>(a.keyframe)] + a.offset + depth(landmark, p) * a.ray;
    // d(point) = (I - D) dp_a + D dp_b
    const Matrix3d D = a.ray * landmark.slope.transpose();
    const Matrix3d by_a = Matrix3d::Identity() - D;
    // The null-space's projector N N^T = I - d d^T stands for N: its square is itself.
    Matrix3d P_sum = Matrix3d::Zero();
    Vector3d Py_sum = Vector3d::Zero();
    const Eigen::Index ka = 3 * a.keyframe, kb = 3 * b.keyframe;
    for (size_t i = 0; i < landmark.views.size(); ++i) {
      const View& view = landmark.views[i];
      if (i == landmark.a || !(view.weight > 0.0)) continue;
      const Matrix3d P = view.weight * (Matrix3d::Identity() - view.ray * view.ray.transpose());
      const Vector3d Py = P * (point - p[static_cast<size_t>(view.keyframe)] - view.offset);
      const Eigen::Index ki = 3 * view.keyframe;
      P_sum += P;
      Py_sum += Py;
      H->block<3, 3>(ki, ki) += P;
      g->segment<3>(ki) -= Py;
      const Matrix3d to_a = P * by_a, to_b = P * D;
      H->block<3, 3>(ki, ka) -= to_a;
      H->block<3, 3>(ka, ki) -= to_a.transpose();
      H->block<3, 3>(ki, kb) -= to_b;
      H->block<3, 3>(kb, ki) -= to_b.transpose();
    }
    H->block<3, 3>(ka, ka) += by_a.transpose() * P_sum * by_a;
    H->block<3, 3>(kb, kb) += D.transpose() * P_sum * D;
    const Matrix3d cross = by_a.transpose() * P_sum * D;
    H->block<3, 3>(ka, kb) += cross;
    H->block<3, 3>(kb, ka) += cross.transpose();
    g->segment<3>(ka) += by_a.transpose() * Py_sum;
    g->segment<3>(kb) += D.transpose() * Py_sum;
  }
}

}  // namespace etalon::plugins
