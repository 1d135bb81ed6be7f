#include "reprojection_refinement.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/world_errors.h"
#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {
constexpr double kMaxChi2 = 16.0;    // a stereo pair's rays meet below it; as [odometry] pose_chi2
constexpr double kConverged = 1e-4;  // m, a tenth of what vision resolves
}  // namespace

ReprojectionRefinement::ReprojectionRefinement(const InitializationProblem& problem,
                                               const std::vector<Matrix3d>& R_VB)
    : R_VB_(R_VB),
      window_(buildVisualWindow(problem.calibration(), problem.keyframes(), problem.sigmaPx())),
      points_(stereoPoints(window_, kMaxChi2)),
      tracks_(window_, std::sqrt(kChi2Pixel)) {}

std::vector<SE3> ReprojectionRefinement::poses(const LinearState& state) const {
  std::vector<SE3> T_VB;
  for (size_t k = 0; k < R_VB_.size(); ++k) T_VB.emplace_back(R_VB_[k], state.p[k]);
  return T_VB;
}

void ReprojectionRefinement::addTo(double factor, MatrixXd* H, VectorXd* gradient) const {
  const Index n = R_VB_.size();
  for (Index i = 1; i < n; ++i) {
    gradient->segment<3>(3 * i) -= factor * tracks_.s().segment<3>(6 * i - 3);
    for (Index j = 1; j < n; ++j)
      H->block<3, 3>(3 * i, 3 * j) += factor * tracks_.S().block<3, 3>(6 * i - 3, 6 * j - 3);
  }
}

SolverSummary ReprojectionRefinement::refine(const ImuAlignment* imu, int passes,
                                             LinearState* state) {
  const Index n = 3 * R_VB_.size(), all = 2 * n + 5;
  const Index size = (imu ? all : n) - 3;  // the first position is the gauge
  tracks_.start(points_, poses(*state));
  SolverSummary summary;
  summary.termination = Termination::kMaxIterations;
  for (int pass = 0; pass < passes; ++pass) {
    ++summary.iterations;
    for (int i = 0; i < (pass == 0 ? 3 : 1); ++i) tracks_.triangulate(poses(*state));
    tracks_.linearize(poses(*state));
    MatrixXd H = MatrixXd::Zero(all, all);
    VectorXd gradient = VectorXd::Zero(all), step = VectorXd::Zero(all);
    addTo(1.0, &H, &gradient);
    if (imu) imu->addTo(*state, &H, &gradient);
    const ScaledCholesky factor(H.block(3, 3, size, size));
    if (factor.determined()) step.segment(3, size) = factor.solve(-gradient.segment(3, size));
    if (!factor.determined() || !step.allFinite()) {
      summary.stop(Termination::kSingular, "the tracks do not determine the positions");
      return summary;
    }
    if (imu) {
      *state = imu->moved(*state, step);
    } else {
      for (size_t k = 0; k < R_VB_.size(); ++k) state->p[k] += step.segment<3>(3 * k);
    }
    if (pass > 0 && tracks_.nearFinalScale() &&
        step.head(n).lpNorm<Eigen::Infinity>() < kConverged) {
      summary.termination = Termination::kConverged;
      return summary;
    }
  }
  return summary;
}

MatrixXd ReprojectionRefinement::covariance(const ImuAlignment& imu, const LinearState& state,
                                            const Matrix3d& gyro_bias) const {
  const Index n = 3 * R_VB_.size(), all = 2 * n + 5;
  const double fisher = tracks_.fisherShare();
  MatrixXd H = MatrixXd::Zero(all, all);
  VectorXd ignored = VectorXd::Zero(all);
  addTo(fisher, &H, &ignored);
  // The gradient's noise from pixels and prior.
  MatrixXd noise = H;
  noise.diagonal().tail<3>().array() += imu.priorScore();
  imu.addTo(state, &H, &ignored);
  // The IMU's noise and b_g reach the gradient through the rotations and the IMU's equations.
  const ImuAlignment::NoiseResponse response = imu.noiseResponse(state, gyro_bias);
  MatrixXd by_sources = response.gradient;
  for (Index i = 1; i < n / 3; ++i)
    for (Index j = 1; j < n / 3; ++j)
      by_sources.middleRows<3>(3 * i) += fisher * tracks_.S().block<3, 3>(6 * i - 3, 6 * j - 6) *
                                         response.rotations.middleRows<3>(3 * j);

  const Eigen::LLT<MatrixXd> information(H.bottomRightCorner(all - 3, all - 3));
  if (information.info() != Eigen::Success) return {};
  // The caller wants b_a, gravity, the last velocity and the poses.
  const Index unknowns = all - 3, last_velocity = 2 * n - 6, moved = n / 3 - 1;
  MatrixXd picked = MatrixXd::Zero(12 + 6 * moved, unknowns);
  picked.block<3, 3>(3, unknowns - 3).setIdentity();
  picked.block<3, 2>(6, unknowns - 5) = state.g_V.norm() * tangentBasis(state.g_V);
  picked.block<3, 3>(9, last_velocity).setIdentity();
  for (Index k = 0; k < moved; ++k) picked.block<3, 3>(12 + 6 * k + 3, 3 * k).setIdentity();
  const MatrixXd by_gradient = information.solve(picked.transpose()).transpose();
  MatrixXd errors = -by_gradient * by_sources.bottomRows(unknowns);
  errors.topRows<3>().rightCols<3>().setIdentity();
  for (Index k = 0; k < moved; ++k)
    errors.middleRows<3>(12 + 6 * k) = response.rotations.middleRows<3>(3 * k + 3);
  const MatrixXd P =
      errors * response.sources * errors.transpose() +
      by_gradient * noise.bottomRightCorner(unknowns, unknowns) * by_gradient.transpose();
  const Matrix3d R_WV = rotationBetween(state.g_V, -Vector3d::UnitZ());
  return covarianceInWorld(P, R_WV, R_WV * state.v.back(), state.g_V.norm());
}

std::optional<ReprojectionRefinement::PositionErrors> ReprojectionRefinement::positionErrors()
    const {
  const Index n = 3 * (R_VB_.size() - 1);
  std::vector<Index> rotations, positions;
  for (Index i = 0; i < n; ++i) {
    rotations.push_back(6 * (i / 3) + i % 3);
    positions.push_back(rotations.back() + 3);
  }
  const MatrixXd S_pp = tracks_.S()(positions, positions);
  const Eigen::LLT<MatrixXd> information(S_pp);
  if (information.info() != Eigen::Success) return std::nullopt;
  PositionErrors errors;
  errors.covariance = MatrixXd::Zero(2 * n, 2 * n);
  errors.covariance(positions, positions) =
      information.solve(MatrixXd::Identity(n, n)) / tracks_.fisherShare();
  errors.by_rotation = -information.solve(tracks_.S()(positions, rotations).eval());
  return errors;
}

}  // namespace etalon::plugins
