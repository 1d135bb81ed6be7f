#include "etalon/optimization/bundle/reduced_information.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "bundle/landmark_views.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/huber.h"

namespace etalon {

namespace {

struct PoseContribution {
  int keyframe;
  Eigen::Matrix<double, 6, 6> H_pp = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 3> H_pl = Eigen::Matrix<double, 6, 3>::Zero();
  /** Sum of the residuals times the mixed derivative by position and rho; made bent by bend(). */
  Eigen::Vector3d mixed = Eigen::Vector3d::Zero();
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  Vector6d bent = Vector6d::Zero();  ///< derivative by rho of the gradient, residuals' part
  Vector6d pull = Vector6d::Zero();  ///< of the best rho by this pose, less what is rigid
  explicit PoseContribution(int k) : keyframe(k) {}
};

/** The derivative of ray_B by the pose is [hat(ray_B), -rho R_WB^T]. */
PoseContribution contribution(const LandmarkView& view, const SE3& T_WB, double rho) {
  const Eigen::Matrix3d turn = hat(view.ray_B), move = -rho * T_WB.R;
  PoseContribution pose(view.keyframe);
  const Eigen::Matrix3d JJ_turn = view.JJ * turn, JJ_move = view.JJ * move.transpose();
  pose.H_pp.topLeftCorner<3, 3>().noalias() = -(turn * JJ_turn);
  pose.H_pp.bottomLeftCorner<3, 3>().noalias() = move * JJ_turn;
  pose.H_pp.topRightCorner<3, 3>() = pose.H_pp.bottomLeftCorner<3, 3>().transpose();
  pose.H_pp.bottomRightCorner<3, 3>().noalias() = move * JJ_move;
  pose.H_pl.topRows<3>().noalias() = -(turn * view.JJ_landmark);
  pose.H_pl.bottomRows<3>().noalias() = move * view.JJ_landmark;
  if (rho > 0.0) pose.mixed.noalias() = -(T_WB.R * view.Jr);
  return pose;
}

/**
 * The curvature's part. Moving the landmark and all cameras together changes no residual, and must
 * change no term of the curvature: what counts is a camera's position relative to the first pose
 * that saw the landmark, in that body's frame, and rho in a chart that goes with that body. There
 * the second derivatives that are left out are small.
 */
void bend(const std::vector<SE3>& T_WB, const InverseDepthLandmark& landmark,
          const Eigen::Matrix3d& V_inv, std::vector<PoseContribution>* poses) {
  PoseContribution& anchor = poses->front();
  const SE3& T_WA = T_WB[anchor.keyframe];
  for (PoseContribution& pose : *poses) {
    pose.pull = pose.H_pl * V_inv.col(2);
    if (pose.keyframe == anchor.keyframe) continue;
    pose.bent.tail<3>() = pose.mixed;
    anchor.bent.tail<3>() -= pose.mixed;
    const Eigen::Vector3d way = T_WB[pose.keyframe].t - T_WA.t;
    anchor.bent.head<3>() -= T_WA.R.transpose() * way.cross(pose.mixed);
  }
  // 1 / rho is the distance along the bearing c; a landmark that the anchor takes along moves it.
  const double rho = landmark.parameters.z();
  const Eigen::Vector3d c = T_WA.R.transpose() * landmark.axes.col(2);
  const Eigen::Vector3d from_anchor =  // rho times the landmark's place in the anchor's body
      T_WA.R.transpose() * (landmark.axes * landmark.parameters.head<2>().homogeneous() +
                            rho * (landmark.origin - T_WA.t));
  anchor.pull.head<3>() -= rho * from_anchor.cross(c);
  anchor.pull.tail<3>() -= rho * rho * landmark.axes.col(2);
}

}  // namespace

RobustWeights huberOfInliers(double width, double sigma) {
  return [width, sigma](const VisualMeasurement& m, double r2) {
    const double weight =
        m.inlier ? huberWeight(std::sqrt(r2), width * sigma) / (sigma * sigma) : 0.0;
    return RobustWeight{weight, weight};
  };
}

void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const LandmarkEstimates& estimates, const RobustWeights& weights,
                                 NormalEquations* equations) {
  LandmarkViews views;
  std::vector<PoseContribution> poses;
  for (size_t l = 0; l < estimates.landmarks.size(); ++l) {
    const InverseDepthLandmark& landmark = estimates.landmarks[l];
    collectViews(window, T_WB, l, landmark, weights, &views);
    if (estimates.held[l]) views.hold();
    poses.clear();
    for (const LandmarkView& view : views.of_keyframe)
      if (view.JJ.trace() > 0.0)
        poses.push_back(contribution(view, T_WB[view.keyframe], landmark.parameters.z()));
    if (poses.empty()) continue;
    views.V.diagonal().array() += 1e-12 * views.V.trace();
    const Eigen::Matrix3d V_inv = views.V.inverse();
    // The curvature's part is linear in the error of an inverse depth that is known.
    if (!estimates.held[l] && V_inv(2, 2) <= kMaxSigmaInverseDepth * kMaxSigmaInverseDepth)
      bend(T_WB, landmark, V_inv, &poses);
    for (size_t i = 0; i < poses.size(); ++i) {
      const PoseContribution& a = poses[i];
      const Eigen::Index row = 6 * a.keyframe;
      equations->add(row, row, a.H_pp);
      const Eigen::Matrix<double, 6, 3> flat = a.H_pl * V_inv;
      const PoseContribution::Vector6d pull = a.pull + V_inv(2, 2) * a.bent;
      for (size_t j = 0; j <= i; ++j) {
        const PoseContribution& b = poses[j];
        const Eigen::Index column = 6 * b.keyframe;
        const Eigen::Matrix<double, 6, 6> score = flat * b.H_pl.transpose();
        Eigen::Matrix<double, 6, 6> curvature = score;
        curvature.noalias() += pull * b.bent.transpose();
        curvature.noalias() += a.bent * b.pull.transpose();
        equations->score.block<6, 6>(row, column) -= score;
        equations->curvature.block<6, 6>(row, column) -= curvature;
      }
    }
  }
  for (Eigen::MatrixXd* symmetric : {&equations->score, &equations->curvature})
    symmetric->triangularView<Eigen::StrictlyUpper>() = symmetric->transpose();
}

void eliminateErrors(const Eigen::VectorXd& information, NormalEquations* equations) {
  // In units of the errors, where W is the identity.
  const Eigen::VectorXd back = information.cwiseSqrt(), root = back.cwiseInverse();
  const Eigen::MatrixXd C = root.asDiagonal() * equations->curvature * root.asDiagonal();
  Eigen::MatrixXd A = C;
  A.diagonal().array() += 1.0;
  const Eigen::MatrixXd K = A.inverse();
  const Eigen::MatrixXd KC = K * C;
  const Eigen::MatrixXd S = root.asDiagonal() * equations->score * root.asDiagonal();
  equations->curvature = back.asDiagonal() * (0.5 * (KC + KC.transpose())) * back.asDiagonal();
  equations->score =
      back.asDiagonal() * (K * S * K.transpose() + KC.transpose() * KC) * back.asDiagonal();
}

}  // namespace etalon
