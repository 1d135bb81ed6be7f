#include "schur.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace etalon {

namespace {

struct PoseContribution {
  int keyframe;
  Eigen::Matrix<double, 6, 6> H_pp = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 3> H_pl = Eigen::Matrix<double, 6, 3>::Zero();
  explicit PoseContribution(int k) : keyframe(k) {}
};

}  // namespace

void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const std::vector<Eigen::Vector3d>& landmarks,
                                 const std::vector<char>& inlier, double chi2_huber, int stride,
                                 Eigen::MatrixXd* H) {
  const double huber = std::sqrt(chi2_huber);
  std::vector<PoseContribution> poses;
  for (size_t l = 0; l < landmarks.size(); ++l) {
    poses.clear();
    Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
    for (int i = window.first[l]; i < window.first[l + 1]; ++i) {
      if (!inlier[static_cast<size_t>(i)]) continue;
      const VisualMeasurement& m = window.measurements[static_cast<size_t>(i)];
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose;
      Eigen::Matrix<double, 2, 3> J_landmark;
      if (!reprojectionResidual(window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                T_WB[static_cast<size_t>(m.keyframe)], landmarks[l], &r, &J_pose,
                                &J_landmark))
        continue;
      const double norm = r.norm();
      const double weight = norm > huber ? huber / norm : 1.0;
      if (poses.empty() || poses.back().keyframe != m.keyframe) poses.emplace_back(m.keyframe);
      poses.back().H_pp.noalias() += weight * J_pose.transpose() * J_pose;
      poses.back().H_pl.noalias() += weight * J_pose.transpose() * J_landmark;
      V.noalias() += weight * J_landmark.transpose() * J_landmark;
    }
    if (poses.empty()) continue;
    V.diagonal().array() += 1e-12 * V.trace();
    const Eigen::Matrix3d V_inv = V.inverse();
    for (const PoseContribution& a : poses) {
      const Eigen::Matrix<double, 6, 3> W_V = a.H_pl * V_inv;
      H->block<6, 6>(stride * a.keyframe, stride * a.keyframe) += a.H_pp;
      for (const PoseContribution& b : poses)
        H->block<6, 6>(stride * a.keyframe, stride * b.keyframe).noalias() -=
            W_V * b.H_pl.transpose();
    }
  }
}

Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information) {
  // Scaled to a unit diagonal first: the blocks' units differ by many orders of magnitude.
  const Eigen::VectorXd diagonal = information.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return {};
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(scale.asDiagonal() * information * scale.asDiagonal());
  if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-15)) return {};
  Eigen::MatrixXd inverse =
      factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  inverse = scale.asDiagonal() * inverse * scale.asDiagonal();
  if (!inverse.allFinite()) return {};
  return 0.5 * (inverse + inverse.transpose());
}

double relabelMeasurements(const VisualWindow& window, const std::vector<SE3>& T_WB,
                           const std::vector<Eigen::Vector3d>& landmarks, double chi2_threshold,
                           std::vector<char>* landmark_valid, std::vector<char>* inlier) {
  double sum = 0.0;
  inlier->assign(window.measurements.size(), 0);
  for (size_t l = 0; l < landmarks.size(); ++l) {
    if (!(*landmark_valid)[l]) continue;
    int count = 0;
    double landmark_sum = 0.0;
    for (int i = window.first[l]; i < window.first[l + 1]; ++i) {
      const VisualMeasurement& m = window.measurements[static_cast<size_t>(i)];
      Eigen::Vector2d r;
      if (!reprojectionResidual(window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                T_WB[static_cast<size_t>(m.keyframe)], landmarks[l], &r) ||
          r.squaredNorm() >= chi2_threshold)
        continue;
      (*inlier)[static_cast<size_t>(i)] = 1;
      landmark_sum += r.squaredNorm();
      ++count;
    }
    if (count >= 2) {
      sum += landmark_sum;
      continue;
    }
    (*landmark_valid)[l] = 0;
    for (int i = window.first[l]; i < window.first[l + 1]; ++i)
      (*inlier)[static_cast<size_t>(i)] = 0;
  }
  return sum;
}

}  // namespace etalon
