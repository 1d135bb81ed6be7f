#include "bundle/visual_inertial_system.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/reduced_information.h"
#include "etalon/optimization/residuals/huber.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "residuals/gauge_cost.h"

namespace etalon {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Gaussian, its components independent. */
LinearizedResidual prior(const VectorXd& at, const VectorXd& mean, const VectorXd& sigma,
                         Index column) {
  LinearizedResidual residual;
  residual.r = (at - mean).cwiseQuotient(sigma);
  residual.parts = {{column, sigma.cwiseInverse().asDiagonal()}};
  return residual;
}

LinearizedResidual gauge(const SE3& T_WB, const SE3& reference) {
  Eigen::Matrix<double, 4, 6> J;
  LinearizedResidual residual;
  residual.r = gaugeResidual(T_WB, reference, &J);
  residual.parts = {{0, J}};
  return residual;
}

/** The lower triangle. */
void add(const std::vector<LinearizedResidual>& residuals, double inertial_width,
         StepEquations* equations) {
  for (const LinearizedResidual& residual : residuals) {
    const double norm = residual.r.norm();
    equations->cost +=
        residual.kind == ResidualKind::kImu ? huberLoss(norm, inertial_width) : 0.5 * norm * norm;
    for (const LinearizedResidual::Part& a : residual.parts) {
      const MatrixXd weighted = residual.weight * a.J.transpose();
      equations->g.segment(a.column, a.J.cols()).noalias() += weighted * residual.r;
      for (const LinearizedResidual::Part& b : residual.parts) {
        if (b.column > a.column) continue;
        equations->H.block(a.column, b.column, a.J.cols(), b.J.cols()).noalias() += weighted * b.J;
      }
    }
  }
}

/** Adds the information of poses, of which a turn of the cameras moves every rotation. */
void addPoses(const MatrixXd& of_poses, Index turn, MatrixXd* information) {
  const Index n = of_poses.rows() / 6;
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const auto block = of_poses.block<6, 6>(6 * i, 6 * j);
      information->block<6, 6>(9 * i, 9 * j) += block;
      information->block<6, 3>(9 * i, turn) += block.leftCols<3>();
      information->block<3, 6>(turn, 9 * j) += block.topRows<3>();
      information->block<3, 3>(turn, turn) += block.topLeftCorner<3, 3>();
    }
}

}  // namespace

std::vector<SE3> VisualInertialUnknowns::seen() const {
  std::vector<SE3> poses = T_WB;
  for (size_t k = 0; k < poses.size(); ++k) poses[k].R = poses[k].R * expSO3(turn + shared[k]);
  return poses;
}

VisualInertialSystem::VisualInertialSystem(const VisualInertialProblem& problem,
                                           const VisualInertialBaOptions& options)
    : problem_(problem),
      options_(options),
      keyframes_(static_cast<Index>(problem.states.size())),
      sigma_shared_rad_(radians(options.sigma_shared_deg)),
      sigma_turn_rad_(radians(options.sigma_turn_deg)),
      slow_modes_(slowErrorModes(problem.preintegrations, problem.priors.slow_accel)),
      sizes_(slow_modes_.rows()),
      visual_(problem.bundle.window) {}

VisualInertialUnknowns VisualInertialSystem::start() const {
  std::vector<SE3> T_WB;
  std::vector<Vector3d> v_WB;
  for (const NavState& s : problem_.states) {
    T_WB.push_back(s.T_WB);
    v_WB.push_back(s.v_WB);
  }
  return {T_WB,
          v_WB,
          problem_.bias,
          Vector3d::Zero(),
          std::vector<Vector3d>(T_WB.size(), Vector3d::Zero()),
          VectorXd::Zero(slowCount()),
          WindowLandmarks(problem_.bundle, T_WB)};
}

LinearizedResidual VisualInertialSystem::inertial(const VisualInertialUnknowns& at, size_t k,
                                                  double white) const {
  const Preintegration& preintegration = problem_.preintegrations[k];
  const VectorXd modes = sizes_.slow * slow_modes_.row(k).transpose();
  ImuBias bias = at.bias;
  if (modes.size() > 0)
    bias.accel += Eigen::Map<const Eigen::Matrix3Xd>(at.slow.data(), 3, modes.size()) * modes;
  Eigen::Matrix<double, 9, 9> L = sqrtInformation(preintegration);
  L.bottomRows<6>() /= white;  // given the rotation's, they are the accelerometer's
  PreintegrationJacobians J;
  LinearizedResidual residual;
  residual.kind = ResidualKind::kImu;
  residual.r = L * preintegrationResidual(preintegration, at.T_WB[k], at.v_WB[k], at.T_WB[k + 1],
                                          at.v_WB[k + 1], bias,
                                          Vector3d(0.0, 0.0, -problem_.gravity_mps2), &J);
  residual.weight = huberWeight(residual.r.norm(), std::sqrt(options_.chi2_inertial));
  Eigen::Matrix<double, 9, 9> before, after;
  before << J.pose_i, J.velocity_i;
  after << J.pose_j, J.velocity_j;
  Eigen::Matrix<double, 9, 6> by_bias;
  by_bias << L * J.bias_gyro, L * J.bias_accel;
  const auto column = 9 * static_cast<Index>(k);
  residual.parts = {{column, L * before}, {column + 9, L * after}, {biasColumn(), by_bias}};
  if (modes.size() == 0) return residual;
  MatrixXd by_modes(9, slowCount());
  for (Index m = 0; m < modes.size(); ++m)
    by_modes.middleCols<3>(3 * m) = modes[m] * by_bias.rightCols<3>();
  residual.parts.push_back({slowColumn(), by_modes});
  return residual;
}

std::vector<LinearizedResidual> VisualInertialSystem::residuals(
    const VisualInertialUnknowns& at) const {
  std::vector<LinearizedResidual> all;
  const VectorXd white = sizes_.whiteByInterval();
  for (size_t k = 0; k < problem_.preintegrations.size(); ++k)
    all.push_back(inertial(at, k, white[static_cast<Index>(k)]));
  const BiasPriors& priors = problem_.priors;
  VectorXd bias(6), mean(6), sigma(6);
  bias << at.bias.gyro, at.bias.accel;
  mean << priors.mean.gyro, priors.mean.accel;
  sigma << Vector3d::Constant(priors.sigma_gyro_rps), Vector3d::Constant(priors.sigma_accel_mps2);
  all.push_back(prior(bias, mean, sigma, biasColumn()));
  all.push_back(
      prior(at.turn, Vector3d::Zero(), Vector3d::Constant(sigma_turn_rad_), turnColumn()));
  if (slowCount() > 0)
    all.push_back(
        prior(at.slow, VectorXd::Zero(slowCount()), VectorXd::Ones(slowCount()), slowColumn()));
  all.push_back(gauge(at.T_WB[0], problem_.states[0].T_WB));
  return all;
}

void VisualInertialSystem::linearizePixels(VisualInertialUnknowns* at, double damping) {
  pixels_ = {MatrixXd::Zero(columns(), columns()), VectorXd::Zero(columns())};
  pixels_.cost = visual_.linearize(at->seen(), {std::sqrt(options_.chi2_pixel), pixel_share_},
                                   damping, &at->landmarks);
  const MatrixXd& H = visual_.H();
  const double information = 1.0 / (sigma_shared_rad_ * sigma_shared_rad_);
  std::vector<Index> rotations;
  VectorXd shared(3 * keyframes_);
  for (Index k = 0; k < keyframes_; ++k) {
    for (Index axis = 0; axis < 3; ++axis) rotations.push_back(6 * k + axis);
    shared.segment<3>(3 * k) = at->shared[static_cast<size_t>(k)];
  }
  MatrixXd own = H(rotations, rotations);
  own.diagonal().array() += information;
  const Eigen::LLT<MatrixXd> factor(own);
  const MatrixXd with_poses = H(rotations, Eigen::all);
  shared_H_ = factor.solve(with_poses);
  const VectorXd shared_gradient = visual_.g()(rotations) + information * shared;
  shared_g_ = factor.solve(shared_gradient);
  pixels_.promised = visual_.promised() + shared_gradient.dot(shared_g_);
  const MatrixXd reduced = H - with_poses.transpose() * shared_H_;
  const VectorXd g = visual_.g() - with_poses.transpose() * shared_g_;
  addPoses(reduced, turnColumn(), &pixels_.H);
  for (Index k = 0; k < keyframes_; ++k) {
    pixels_.g.segment<6>(9 * k) += g.segment<6>(6 * k);
    pixels_.g.segment<3>(turnColumn()) += g.segment<3>(6 * k);
  }
  pixels_.cost += 0.5 * information * shared.squaredNorm();
}

StepEquations VisualInertialSystem::equations(
    const std::vector<LinearizedResidual>& residuals) const {
  StepEquations all = pixels_;
  add(residuals, std::sqrt(options_.chi2_inertial), &all);
  return all;
}

VisualInertialUnknowns VisualInertialSystem::moved(const VisualInertialUnknowns& from,
                                                   const VectorXd& step) const {
  // The turn of the first keyframe turns all about its place, landmarks too, and exactly: pixels are
  // blind to it, and would see the square of a tilt that is taken to first order.
  const Vector3d omega = from.T_WB[0].R * step.head<3>(), pivot = from.T_WB[0].t;
  const Eigen::Matrix3d all = expSO3(omega);
  VisualInertialUnknowns to = from;
  const Vector3d turn = step.segment<3>(turnColumn());
  VectorXd d(6 * keyframes_);  // what is left for the poses that the cameras see
  for (Index k = 0; k < keyframes_; ++k) {
    const auto index = static_cast<size_t>(k);
    SE3& T_WB = to.T_WB[index];
    Vector3d& v_WB = to.v_WB[index];
    const Vector3d turned = step.segment<3>(9 * k) - T_WB.R.transpose() * omega;
    const Vector3d moved = step.segment<3>(9 * k + 3) - omega.cross(T_WB.t - pivot);
    const Vector3d faster = step.segment<3>(9 * k + 6) - omega.cross(v_WB);
    T_WB.R = all * T_WB.R * expSO3(turned);
    T_WB.t = pivot + all * (T_WB.t + moved - pivot);
    v_WB = all * (v_WB + faster);
    d.segment<6>(6 * k) << turned + turn, moved;
  }
  to.bias.gyro += step.segment<3>(biasColumn());
  to.bias.accel += step.segment<3>(biasColumn() + 3);
  to.turn += turn;
  to.slow += step.tail(slowCount());
  const VectorXd shared = -shared_g_ - shared_H_ * d;
  for (Index k = 0; k < keyframes_; ++k) {
    to.shared[static_cast<size_t>(k)] += shared.segment<3>(3 * k);
    d.segment<3>(6 * k) += shared.segment<3>(3 * k);
  }
  visual_.moveLandmarks(d, &to.landmarks);
  for (InverseDepthLandmark& landmark : to.landmarks.landmarks) {
    landmark.origin = pivot + all * (landmark.origin - pivot);
    landmark.axes = all * landmark.axes;
  }
  return to;
}

NormalEquations VisualInertialSystem::visualEquations(const VisualInertialUnknowns& at) const {
  NormalEquations visual(6 * keyframes_);
  addReducedVisualInformation(
      problem_.bundle.window, at.seen(), {at.landmarks.landmarks, at.landmarks.held},
      huberOfInliers(std::sqrt(options_.chi2_pixel), pixel_share_), &visual);
  return visual;
}

NormalEquations VisualInertialSystem::normalEquations(
    NormalEquations visual, double visual_share,
    const std::vector<LinearizedResidual>& residuals) const {
  visual.score *= visual_share;
  visual.curvature *= visual_share;
  Eigen::Matrix<double, 6, 1> information;  // of positions there is no shared error
  information << Vector3d::Constant(std::pow(sigma_shared_rad_, -2)),
      Vector3d::Constant(std::pow(kGaugeInverseSigma, 2));
  eliminateErrors(information.replicate(keyframes_, 1), &visual);
  NormalEquations equations(columns());
  addPoses(visual.score, turnColumn(), &equations.score);
  addPoses(visual.curvature, turnColumn(), &equations.curvature);
  addInformation(residuals, &equations);
  return equations;
}

}  // namespace etalon
