#pragma once

// What the cameras say of one landmark, summed by keyframe. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "etalon/optimization/bundle/reduced_information.h"
#include "etalon/optimization/bundle/visual_window.h"
#include "residuals/reprojection_cost.h"

namespace etalon {

/** Sums over a keyframe's measurements of a landmark; J is the derivative by ray_B. */
struct LandmarkView {
  int keyframe;
  Eigen::Vector3d ray_B;  ///< rho times the landmark's place in the body
  Eigen::Matrix3d JJ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d JJ_landmark = Eigen::Matrix3d::Zero();  ///< of J and the landmark's own
  Eigen::Vector3d Jr = Eigen::Vector3d::Zero();
};

/** The views of a landmark, one a keyframe, and its own block. */
struct LandmarkViews {
  std::vector<LandmarkView> of_keyframe;
  Eigen::Matrix3d V;
  Eigen::Vector3d g;

  /** The landmark's rho is no unknown. */
  void hold() {
    V.row(2).setZero();
    V.col(2).setZero();
    g.z() = 0.0;
    for (LandmarkView& view : of_keyframe) view.JJ_landmark.col(2).setZero();
  }
};

/**
 * Linearises landmark `l` of the window. JJ, JJ_landmark and V are weighted by what `weights` says
 * of the curvature, Jr and g by its gradient.
 * @param weights RobustWeights, or what can be called as one; of a measurement whose landmark is
 *     behind the camera its answer, to the residual of a gross outlier, does not count
 */
template <typename Weights>
void collectViews(const VisualWindow& window, const std::vector<SE3>& T_WB, size_t l,
                  const InverseDepthLandmark& landmark, const Weights& weights,
                  LandmarkViews* views) {
  using Matrix23 = Eigen::Matrix<double, 2, 3>;
  views->of_keyframe.clear();
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  const double rho = landmark.parameters.z();
  const Eigen::Vector3d bearing = landmark.axes * landmark.parameters.head<2>().homogeneous();
  Eigen::Matrix3d by_landmark = Eigen::Matrix3d::Zero();  // of ray_B
  for (const VisualMeasurement& m : window.measurementsOf(l)) {
    if (views->of_keyframe.empty() || views->of_keyframe.back().keyframe != m.keyframe) {
      const SE3& pose = T_WB[m.keyframe];
      const Eigen::Vector3d to_origin = landmark.origin - pose.t;
      views->of_keyframe.emplace_back();
      views->of_keyframe.back().keyframe = m.keyframe;
      views->of_keyframe.back().ray_B.noalias() = pose.R.transpose() * (bearing + rho * to_origin);
      by_landmark.leftCols<2>().noalias() = pose.R.transpose() * landmark.axes.leftCols<2>();
      by_landmark.col(2).noalias() = pose.R.transpose() * to_origin;
    }
    LandmarkView& view = views->of_keyframe.back();
    const SE3& T_CB = window.T_CB[m.camera];
    Eigen::Vector2d r;
    Matrix23 J_C;
    if (!reprojectionResidual(m.measurement, T_CB.R * view.ray_B + rho * T_CB.t, rho, &r, &J_C)) {
      weights(m, kGrossOutlier * kGrossOutlier);
      continue;
    }
    const RobustWeight weight = weights(m, r.squaredNorm());
    if (weight.curvature == 0.0) continue;
    const Matrix23 J = J_C * T_CB.R;
    Matrix23 J_landmark = J * by_landmark;
    J_landmark.col(2).noalias() += J_C * T_CB.t;
    const Matrix23 weighted_landmark = weight.curvature * J_landmark;
    const Matrix23 weighted = weight.curvature * J;
    const Eigen::Vector2d weighted_r = weight.gradient * r;
    view.JJ.noalias() += weighted.transpose() * J;
    view.JJ_landmark.noalias() += J.transpose() * weighted_landmark;
    view.Jr.noalias() += J.transpose() * weighted_r;
    V.noalias() += J_landmark.transpose() * weighted_landmark;
    g.noalias() += J_landmark.transpose() * weighted_r;
  }
  views->V = V;
  views->g = g;
}

}  // namespace etalon
