#include "bundle/visual_inertial_system.h"

#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <deque>
#include <functional>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "etalon/testing/expect_jacobian.h"
#include "residuals/gauge_cost.h"
#include "residuals/pose_manifold.h"
#include "visual_inertial_case.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::Map;
using Eigen::Vector3d;
using Eigen::VectorXd;

/** Noisy pixels and IMU, turned cameras, a slow error of fixed size; it starts beside the truth. */
VisualInertialProblem noisyProblem() {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.keyframes = 5;
  options.landmarks = 40;
  options.sigma_px = 0.7;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  VisualInertialCase c(options, options.sigma_px);
  VisualInertialProblem problem{BundleProblem(c.window, testing::knownLandmarks(c.landmarks)),
                                c.preintegrations,
                                c.states,
                                {},
                                c.priors,
                                options.gravity_mps2};
  SlowAcceleration& slow = problem.priors.slow_accel;
  slow.sigma_mps2 = 0.05;
  slow.time_s = 0.5;
  slow.spread = slow.white_spread = slow.jolt_spread = 0.0;
  const Eigen::Matrix3d tilt = expSO3({0.01, -0.02, 0.0});
  for (NavState& state : problem.states) {
    state.T_WB.R = tilt * state.T_WB.R;
    state.v_WB += Vector3d(0.1, -0.1, 0.05);
  }
  return problem;
}

TEST(VisualInertialSystem, JacobiansAgreeWithDifferences) {
  const VisualInertialProblem problem = noisyProblem();
  const VisualInertialBaOptions options;
  VisualInertialSystem system(problem, options);
  VisualInertialUnknowns at = system.start();
  system.linearizePixels(&at);
  const VectorXd away = VectorXd::LinSpaced(system.columns(), -0.01, 0.02);
  at = system.moved(at, away);
  const std::vector<LinearizedResidual> residuals = system.residuals(at);
  ASSERT_EQ(residuals.size(), problem.preintegrations.size() + 4);
  for (size_t i = 0; i < residuals.size(); ++i) {
    SCOPED_TRACE(i);
    for (const LinearizedResidual::Part& part : residuals[i].parts) {
      SCOPED_TRACE(part.column);
      const auto after = [&](const VectorXd& d) {
        VectorXd step = VectorXd::Zero(system.columns());
        step.segment(part.column, d.size()) = d;
        return system.residuals(system.moved(at, step))[i].r;
      };
      testing::expectJacobian(part.J, after, VectorXd(VectorXd::Zero(part.J.cols())));
    }
  }
}

/** A residual whose derivatives Ceres takes by differences. */
struct Numeric {
  std::function<VectorXd(double const* const*)> residual;
  bool operator()(double const* const* parameters, double* r) const {
    const VectorXd values = residual(parameters);
    Map<VectorXd>(r, values.size()) = values;
    return true;
  }
};

SE3 poseOf(const double* block) {
  PoseBlock unit;
  Map<Eigen::Matrix<double, 7, 1>>(unit.data()) = Map<const Eigen::Matrix<double, 7, 1>>(block);
  Map<Eigen::Quaterniond>(unit.data()).normalize();
  return fromBlock(unit.data());
}

/** The problem as its definitions say it, nothing eliminated, solved by Ceres. */
class Batch {
 public:
  Batch(const VisualInertialProblem& problem, const VisualInertialBaOptions& options)
      : problem_(problem),
        options_(options),
        modes_(slowErrorModes(problem.preintegrations, problem.priors.slow_accel)),
        slow_(VectorXd::Zero(3 * modes_.cols())) {
    std::vector<SE3> T_WB;
    for (const NavState& state : problem.states) {
      T_WB.push_back(state.T_WB);
      poses_.push_back(toBlock(state.T_WB));
      velocities_.push_back(state.v_WB);
      shared_.emplace_back(Vector3d::Zero());
    }
    bias_ << problem.bias.gyro, problem.bias.accel;
    landmarks_ = WindowLandmarks(problem.bundle, T_WB).landmarks;
    for (PoseBlock& pose : poses_) ceres_.AddParameterBlock(pose.data(), 7, new PoseManifold);
    addPixels();
    addInertial();
    addPriors();
  }

  double solve() {
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.max_num_iterations = 200;
    solver.function_tolerance = 1e-15;
    solver.parameter_tolerance = 1e-14;
    solver.initial_trust_region_radius = 1e8;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &ceres_, &summary);
    return summary.final_cost;
  }

  NavState state(size_t k) const {
    return {fromBlock(poses_[k].data()), velocities_[k], {bias_.head<3>(), bias_.tail<3>()}};
  }

 private:
  void add(Index rows, const std::vector<std::pair<double*, int>>& blocks, double huber,
           std::function<VectorXd(double const* const*)> residual) {
    auto cost = std::make_unique<ceres::DynamicNumericDiffCostFunction<Numeric>>(
        new Numeric{std::move(residual)});
    std::vector<double*> parameters;
    for (const auto& [block, size] : blocks) {
      cost->AddParameterBlock(size);
      parameters.push_back(block);
    }
    cost->SetNumResiduals(static_cast<int>(rows));
    ceres_.AddResidualBlock(cost.release(), huber > 0.0 ? new ceres::HuberLoss(huber) : nullptr,
                            parameters);
  }

  void addPixels() {
    for (const VisualMeasurement& m : problem_.bundle.window.measurements) {
      if (!m.inlier) continue;
      InverseDepthLandmark& landmark = landmarks_[m.landmark];
      add(2,
          {{poses_[m.keyframe].data(), 7},
           {turn_.data(), 3},
           {shared_[m.keyframe].data(), 3},
           {landmark.parameters.data(), 3}},
          std::sqrt(options_.chi2_pixel), [&, m](double const* const* p) {
            SE3 seen = poseOf(p[0]);
            seen.R = seen.R * expSO3(Map<const Vector3d>(p[1]) + Map<const Vector3d>(p[2]));
            InverseDepthLandmark moved = landmark;
            moved.parameters = Map<const Vector3d>(p[3]);
            Eigen::Vector2d r(kGrossOutlier, 0.0);
            reprojectionResidual(problem_.bundle.window.T_CB[m.camera], m.measurement, seen, moved,
                                 &r);
            return VectorXd(r);
          });
    }
  }

  void addInertial() {
    for (size_t k = 0; k < problem_.preintegrations.size(); ++k)
      add(9,
          {{poses_[k].data(), 7},
           {velocities_[k].data(), 3},
           {poses_[k + 1].data(), 7},
           {velocities_[k + 1].data(), 3},
           {bias_.data(), 6},
           {slow_.data(), static_cast<int>(slow_.size())}},
          std::sqrt(options_.chi2_inertial), [&, k](double const* const* p) {
            const Vector3d slow = Map<const Eigen::Matrix3Xd>(p[5], 3, modes_.cols()) *
                                  modes_.row(static_cast<Index>(k)).transpose();
            const ImuBias bias{Map<const Vector3d>(p[4]), Map<const Vector3d>(p[4] + 3) + slow};
            const Preintegration& imu = problem_.preintegrations[k];
            return VectorXd(sqrtInformation(imu) *
                            preintegrationResidual(imu, poseOf(p[0]), Map<const Vector3d>(p[1]),
                                                   poseOf(p[2]), Map<const Vector3d>(p[3]), bias,
                                                   {0.0, 0.0, -problem_.gravity_mps2}));
          });
  }

  void addPrior(double* block, int size, double sigma) {
    add(size, {{block, size}}, 0.0,
        [=](double const* const* p) { return VectorXd(Map<const VectorXd>(p[0], size) / sigma); });
  }
  void addPriors() {
    add(6, {{bias_.data(), 6}}, 0.0, [&](double const* const* p) {
      const BiasPriors& priors = problem_.priors;
      VectorXd r(6);
      r << (Map<const Vector3d>(p[0]) - priors.mean.gyro) / priors.sigma_gyro_rps,
          (Map<const Vector3d>(p[0] + 3) - priors.mean.accel) / priors.sigma_accel_mps2;
      return r;
    });
    addPrior(turn_.data(), 3, radians(options_.sigma_turn_deg));
    for (Vector3d& shared : shared_) addPrior(shared.data(), 3, radians(options_.sigma_shared_deg));
    addPrior(slow_.data(), static_cast<int>(slow_.size()), 1.0);
    add(4, {{poses_[0].data(), 7}}, 0.0, [&](double const* const* p) {
      return VectorXd(gaugeResidual(poseOf(p[0]), problem_.states[0].T_WB));
    });
  }

  const VisualInertialProblem& problem_;
  const VisualInertialBaOptions& options_;
  Eigen::MatrixXd modes_;
  std::deque<PoseBlock> poses_;
  std::deque<Vector3d> velocities_, shared_;
  Eigen::Matrix<double, 6, 1> bias_;
  Vector3d turn_ = Vector3d::Zero();
  VectorXd slow_;
  std::vector<InverseDepthLandmark> landmarks_;
  ceres::Problem ceres_;
};

/** How far VI-BA's result is from the batch's, the farthest state in its standard deviations. */
double sigmasFromBatch(VisualInertialProblem problem, VisualInertialBaOptions options) {
  options.rounds = 1;
  options.converged_sigmas = 1e-6;
  options.reintegrate_gyro_rps = options.reintegrate_accel_mps2 = 1e9;
  const VisualInertialBaResult result = solveVisualInertialBa(problem, options);
  EXPECT_TRUE(result.summary.converged());
  std::vector<SE3> T_WB;
  for (const NavState& state : problem.states) T_WB.push_back(state.T_WB);
  problem.bundle.relabel(T_WB, kGrossOutlier * kGrossOutlier);  // as the first round
  Batch batch(problem, options);
  const double cost = batch.solve();
  EXPECT_NEAR(result.summary.final_cost, cost, 1e-6 * cost);
  const VectorXd sigma = result.covariance.diagonal().cwiseSqrt();
  double farthest = 0.0;
  for (size_t k = 0; k < problem.states.size(); ++k) {
    const Eigen::Matrix<double, 15, 1> apart = batch.state(k).minus(result.states[k]);
    VectorXd of_state(15);
    of_state << sigma.segment<9>(9 * static_cast<Index>(k)), sigma.tail<6>();
    farthest = std::max(farthest, apart.cwiseQuotient(of_state).norm());
  }
  return farthest;
}

TEST(VisualInertialBa, HasTheMinimumOfACeresBatchThatEliminatesNothing) {
  VisualInertialBaOptions options;
  // Turns of the cameras are taken for small ones.
  EXPECT_LT(sigmasFromBatch(noisyProblem(), options), 5e-3);
  options.sigma_turn_deg = options.sigma_shared_deg = 1e-4;
  EXPECT_LT(sigmasFromBatch(noisyProblem(), options), 1e-4);
}

}  // namespace
}  // namespace etalon
