#include "etalon/initialization/steps/combined_rows.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <utility>

namespace etalon {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

LeastSquares::LeastSquares(const MatrixXd& M) {
  if (M.rows() < M.cols()) return;
  const VectorXd scale = M.colwise().norm().cwiseInverse();
  if (!scale.allFinite()) return;
  const Eigen::JacobiSVD<MatrixXd> svd(M * scale.asDiagonal(),
                                       Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd& values = svd.singularValues();
  if (!(values[values.size() - 1] > 0.0)) return;
  condition = values[0] / values[values.size() - 1];
  response = scale.asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal() *
             svd.matrixU().transpose();
}

CombinedRows::CombinedRows(const InitializationProblem& problem,
                           const std::vector<Preintegration>& pairs,
                           const VisualFrameEstimate& estimate, MatrixXd combination)
    : rows(linearAlignmentRows(estimate.T_VB, pairs, estimate.bias)),
      T(std::move(combination)),
      pair_scale(VectorXd::Zero(rows.y.size())) {
  for (const SE3& T_VB : estimate.T_VB)
    camera.push_back(T_VB * problem.calibration().cameras[0].T_BC.t);
  for (size_t k = 0; k < pairs.size(); ++k)
    pair_scale.segment<3>(6 * k) = -(estimate.T_VB[k].R.transpose() * (camera[k + 1] - camera[k]));
  first_velocity = T * rows.A.leftCols<3>();
  gravity = T * rows.A.rightCols<3>();
  accel = T * rows.by_bias.rightCols<3>();
  scale = T * pair_scale;
  y = T * rows.y;
}

MatrixXd whiteningOf(const CombinedRows& rows, const ErrorSources& sources) {
  const MatrixXd exact = MatrixXd::Zero(6, sources.poses().cols());
  const Eigen::LLT<MatrixXd> noise(sources.covarianceOf(rows.errors(sources, exact)));
  if (noise.info() != Eigen::Success) return {};
  return noise.matrixL().solve(MatrixXd::Identity(rows.y.size(), rows.y.size()));
}

void solveVelocities(const std::vector<Preintegration>& pairs, VisualFrameEstimate* estimate) {
  const std::vector<SE3>& T_VB = estimate->T_VB;
  const Vector3d& g = estimate->g_V;
  for (size_t k = 0; k < pairs.size(); ++k) {
    const double dt = pairs[k].dt();
    const Preintegration::Deltas d = pairs[k].corrected(estimate->bias);
    estimate->v_VB.emplace_back((T_VB[k + 1].t - T_VB[k].t - T_VB[k].R * d.dp - 0.5 * dt * dt * g) /
                                dt);
    if (k + 1 == pairs.size())
      estimate->v_VB.emplace_back(estimate->v_VB[k] + g * dt + T_VB[k].R * d.dv);
  }
}

void addErrors(const CombinedRows& rows, const std::vector<Preintegration>& pairs,
               const std::vector<SE3>& T_VB, const MatrixXd& accel, const MatrixXd& gravity,
               const MatrixXd& scale, StateErrors* errors) {
  const Index N = T_VB.size();
  MatrixXd map(StateErrors::kVelocity + 3 * N, gravity.cols());
  map.topRows<3>() = errors->map.topRows<3>();
  map.middleRows<3>(StateErrors::kAccel) = accel;
  map.middleRows<3>(StateErrors::kGravity) = gravity;
  MatrixXd of_rows =
      rowErrors(rows.rows, errors->sources, errors->sources.poses(), map.topRows<6>());
  if (scale.size() > 0) of_rows -= rows.pair_scale * scale;
  for (Index k = 0; k + 1 < N; ++k) {
    const double dt = pairs[k].dt();
    map.middleRows<3>(StateErrors::kVelocity + 3 * k) =
        T_VB[k].R * of_rows.middleRows<3>(6 * k) / dt - 0.5 * dt * gravity;
  }
  map.bottomRows<3>() = map.middleRows<3>(map.rows() - 6) + pairs.back().dt() * gravity -
                        T_VB[N - 2].R * of_rows.bottomRows<3>();
  errors->map = std::move(map);
}

void rescale(double factor, const std::vector<Vector3d>& camera, VisualFrameEstimate* estimate) {
  for (size_t k = 0; k < camera.size(); ++k)
    estimate->T_VB[k].t += (factor - 1.0) * (camera[k] - camera[0]);
  for (auto& [id, p_V] : estimate->landmarks) p_V += (factor - 1.0) * (p_V - camera[0]);
}

}  // namespace etalon
