#include "bundle/visual_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>

#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/huber.h"
#include "residuals/reprojection_cost.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

double VisualEquations::linearize(const std::vector<SE3>& T_WB, const PixelLoss& loss,
                                  WindowLandmarks* landmarks) {
  const auto n = static_cast<Index>(T_WB.size());
  R_BW_.clear();
  p_W_.clear();
  for (const SE3& pose : T_WB) {
    R_BW_.emplace_back(pose.R.transpose());
    p_W_.push_back(pose.t);
  }
  mixed_.clear();
  mixed_.reserve(window_.measurements.size());
  eliminated_.clear();
  H_.setZero(6 * n, 6 * n);
  g_.setZero(6 * n);
  double cost = 0.0;
  for (size_t l = 0; l < landmarks->landmarks.size(); ++l) cost += collect(l, loss, landmarks);
  // So far positions move along the axes of the body.
  for (Index k = 0; k < n; ++k) {
    const Index at = 6 * k + 3;
    g_.segment<3>(at) = (T_WB[k].R * g_.segment<3>(at)).eval();
    H_.middleRows<3>(at).leftCols(at + 3) = (T_WB[k].R * H_.middleRows<3>(at).leftCols(at + 3)).eval();
    H_.middleCols<3>(at).bottomRows(6 * n - at) =
        (H_.middleCols<3>(at).bottomRows(6 * n - at) * R_BW_[k]).eval();
  }
  H_.triangularView<Eigen::StrictlyUpper>() = H_.transpose();
  return cost;
}

double VisualEquations::collect(size_t l, const PixelLoss& loss, WindowLandmarks* landmarks) {
  const InverseDepthLandmark& landmark = landmarks->landmarks[l];
  const double rho = landmark.parameters.z();
  const double weight = 1.0 / (loss.sigma * loss.sigma), width = loss.width * loss.sigma;
  const Vector3d bearing = landmark.axes * landmark.parameters.head<2>().homogeneous();
  double cost = 0.0;
  Matrix3d V = Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  Matrix3d by_landmark = Matrix3d::Zero();  // of ray_B
  views_.clear();
  for (const VisualMeasurement& m : window_.measurementsOf(l)) {
    if (!m.inlier) continue;
    if (views_.empty() || views_.back().keyframe != m.keyframe) {
      const Matrix3d& R_BW = R_BW_[m.keyframe];
      const Vector3d to_origin = landmark.origin - p_W_[m.keyframe];
      views_.emplace_back();
      views_.back().keyframe = m.keyframe;
      views_.back().ray_B.noalias() = R_BW * (bearing + rho * to_origin);
      by_landmark.leftCols<2>().noalias() = R_BW * landmark.axes.leftCols<2>();
      by_landmark.col(2).noalias() = R_BW * to_origin;
    }
    View& view = views_.back();
    const SE3& T_CB = window_.T_CB[m.camera];
    Eigen::Vector2d r;
    Matrix23 J_C;
    if (!reprojectionResidual(m.measurement, T_CB.R * view.ray_B + rho * T_CB.t, rho, &r, &J_C)) {
      cost += weight * huberLoss(kGrossOutlier, width);
      continue;
    }
    const double norm = r.norm(), w = weight * huberWeight(norm, width);
    cost += weight * huberLoss(norm, width);
    const Matrix23 J = J_C * T_CB.R;
    Matrix23 J_landmark = J * by_landmark;
    J_landmark.col(2).noalias() += J_C * T_CB.t;
    const Matrix23 weighted = w * J, weighted_landmark = w * J_landmark;
    view.JJ.noalias() += weighted.transpose() * J;
    view.JJ_landmark.noalias() += weighted.transpose() * J_landmark;
    view.Jr.noalias() += weighted.transpose() * r;
    V.noalias() += weighted_landmark.transpose() * J_landmark;
    g.noalias() += weighted_landmark.transpose() * r;
  }
  if (views_.empty()) return cost;
  landmarks->held[l] = !(rho > 0.0) && g.z() >= 0.0;
  if (landmarks->held[l]) {
    V.row(2).setZero();
    V.col(2).setZero();
    g.z() = 0.0;
    for (View& view : views_) view.JJ_landmark.col(2).setZero();
  }
  eliminate(l, rho, V, g);
  return cost;
}

/** Adds views_, and takes away what the landmark can explain: the lower triangle. The derivative of
 * ray_B by the pose is [hat(ray_B), -rho I], positions along the body's axes. */
void VisualEquations::eliminate(size_t l, double rho, Matrix3d V, const Vector3d& g) {
  // Without parallax the distance is not determined: it stays where it is.
  V.diagonal() += 1e-9 * V.diagonal() + Vector3d(1e-12, 1e-12, 1e-6);
  Eliminated e{l, mixed_.size(), 0, Matrix3d::Identity(), {}};
  V.llt().matrixU().solveInPlace(e.root);
  e.root_g = e.root.transpose() * g;
  for (const View& view : views_) {
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
    parameters.noalias() -= e.root * root_g;
    if (parameters.z() >= 0.0) continue;
    // The best with rho = 0.
    const Vector3d with_rho = e.root * e.root.row(2).transpose();
    parameters -= parameters.z() / with_rho.z() * with_rho;
  }
}

}  // namespace etalon
