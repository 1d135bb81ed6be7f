#include "bundle/visual_equations.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "etalon/core/inverse_root.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/huber.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

double VisualEquations::linearize(const std::vector<SE3>& T_WB, const PixelLoss& loss,
                                  double damping, WindowLandmarks* landmarks) {
  const auto n = static_cast<Index>(T_WB.size());
  R_BW_.clear();
  for (const SE3& pose : T_WB) R_BW_.emplace_back(pose.R.transpose());
  promised_ = 0.0;
  mixed_.clear();
  mixed_.reserve(window_.measurements.size());
  eliminated_.clear();
  H_.setZero(6 * n, 6 * n);
  g_.setZero(6 * n);
  double cost = 0.0;
  const double scale = 1.0 / (loss.sigma * loss.sigma), width = loss.width * loss.sigma;
  const auto weights = [&](const VisualMeasurement& m, double r2) {
    if (!m.inlier) return RobustWeight();
    const double norm = std::sqrt(r2), weight = scale * huberWeight(norm, width);
    cost += scale * huberLoss(norm, width);
    return RobustWeight{weight, weight};
  };
  for (size_t l = 0; l < landmarks->landmarks.size(); ++l) {
    const double rho = landmarks->landmarks[l].parameters.z();
    collectViews(window_, T_WB, l, landmarks->landmarks[l], weights, &views_);
    landmarks->held[l] = !(rho > 0.0) && views_.g.z() >= 0.0;
    if (landmarks->held[l]) views_.hold();
    eliminate(l, rho, damping);
  }
  // So far positions move along the axes of the body.
  for (Index k = 0; k < n; ++k) {
    const Index at = 6 * k + 3;
    g_.segment<3>(at) = (T_WB[k].R * g_.segment<3>(at)).eval();
    H_.middleRows<3>(at).leftCols(at + 3) =
        (T_WB[k].R * H_.middleRows<3>(at).leftCols(at + 3)).eval();
    H_.middleCols<3>(at).bottomRows(6 * n - at) =
        (H_.middleCols<3>(at).bottomRows(6 * n - at) * R_BW_[k]).eval();
  }
  H_.triangularView<Eigen::StrictlyUpper>() = H_.transpose();
  return cost;
}

// The derivative of ray_B by the pose is [hat(ray_B), -rho I], positions along the body's axes.
void VisualEquations::eliminate(size_t l, double rho, double damping) {
  Matrix3d V = views_.V;
  // Without parallax the distance is not determined: it stays where it is.
  V.diagonal() += (1e-9 + damping) * V.diagonal() + Vector3d(1e-12, 1e-12, 1e-6);
  Eliminated e{l, mixed_.size(), 0, inverseRoot(V), {}, false};
  e.root_g = e.root.transpose() * views_.g;
  e.keeps_rho = e.root.row(2).squaredNorm() > kMaxSigmaInverseDepth * kMaxSigmaInverseDepth;
  promised_ += e.keeps_rho
                   ? views_.g.head<2>().dot(V.topLeftCorner<2, 2>().inverse() * views_.g.head<2>())
                   : e.root_g.squaredNorm();
  for (const LandmarkView& view : views_.of_keyframe) {
    const Index row = 6 * view.keyframe;
    const Matrix3d hat_ray = hat(view.ray_B), turned = hat_ray * view.JJ;
    H_.block<3, 3>(row, row).noalias() -= turned * hat_ray;
    H_.block<3, 3>(row + 3, row) += rho * turned.transpose();
    H_.block<3, 3>(row + 3, row + 3) += rho * rho * view.JJ;
    g_.segment<3>(row) += view.Jr.cross(view.ray_B);
    g_.segment<3>(row + 3) -= rho * view.Jr;
    mixed_.emplace_back();
    Mixed& mixed = mixed_.back();
    mixed.keyframe = view.keyframe;
    const Matrix3d scaled = view.JJ_landmark * e.root;
    mixed.with_root.topRows<3>().noalias() = -hat_ray * scaled;
    mixed.with_root.bottomRows<3>() = -rho * scaled;
    g_.segment<6>(row).noalias() -= mixed.with_root * e.root_g;
    for (size_t j = e.first; j < mixed_.size(); ++j)
      H_.block<6, 6>(row, 6 * mixed_[j].keyframe).noalias() -=
          mixed.with_root * mixed_[j].with_root.transpose();
  }
  e.last = mixed_.size();
  eliminated_.push_back(e);
}

void VisualEquations::moveLandmarks(const Eigen::VectorXd& d, WindowLandmarks* landmarks) const {
  std::vector<Vector6d> d_B;
  for (size_t k = 0; k < R_BW_.size(); ++k) {
    d_B.emplace_back(d.segment<6>(6 * static_cast<Index>(k)));
    d_B.back().tail<3>() = (R_BW_[k] * d_B.back().tail<3>()).eval();
  }
  for (const Eliminated& e : eliminated_) {
    Vector3d root_g = e.root_g;
    for (size_t i = e.first; i < e.last; ++i)
      root_g.noalias() += mixed_[i].with_root.transpose() * d_B[mixed_[i].keyframe];
    Vector3d& parameters = landmarks->landmarks[e.landmark].parameters;
    const double before = parameters.z();
    parameters.noalias() -= e.root * root_g;
    const double rho = e.keeps_rho ? before : std::max(0.0, parameters.z());
    if (parameters.z() != rho) parameters = withThird(parameters, rho, e.root);
  }
}

}  // namespace etalon
