#include "imu_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "etalon/core/so3.h"
#include "etalon/testing/expect_jacobian.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon::plugins {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

constexpr double kGravity = 9.81;

/** A noise-free window in V with known rotations. */
struct Case {
  explicit Case(Motion motion) {
    options.motion = motion;
    options.keyframes = 4;
    options.bias.accel = testing::kBiases.accel;
    window = testing::makeSyntheticWindow(options);
    preintegrations = makeProblem(window, options).preintegrate(ImuBias());
    const SE3 T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& state : window.truth) {
      R_VB.push_back(T_VW.R * state.T_WB.R);
      truth.p.push_back(T_VW * state.T_WB.t);
      truth.v.push_back(T_VW.R * state.v_WB);
    }
    truth.g_V = T_VW.R * Vector3d(0, 0, -kGravity);
    truth.b_a = options.bias.accel;
  }
  ImuAlignment alignment(const Vector3d& prior_mean, double prior_sigma) const {
    return {R_VB, preintegrations, kGravity, prior_mean, prior_sigma};
  }

  SyntheticWindowOptions options;
  SyntheticWindow window;
  std::vector<Matrix3d> R_VB;
  std::vector<Preintegration> preintegrations;
  LinearState truth;
};

/** The whitened residuals of README.md's equations, with the raw IMU integrated anew at b_a. */
VectorXd residuals(const Case& c, const LinearState& s, const Vector3d& mean, double sigma) {
  const Index pairs = c.preintegrations.size();
  VectorXd r(6 * pairs + 3);
  for (size_t k = 0; k < c.preintegrations.size(); ++k) {
    const Preintegration imu = c.preintegrations[k].reintegrated({Vector3d::Zero(), s.b_a});
    const double dt = imu.dt();
    const Matrix3d R_BV = c.R_VB[k].transpose();
    Eigen::Matrix<double, 6, 1> e;
    e << R_BV * (s.p[k + 1] - s.p[k] - s.v[k] * dt - 0.5 * dt * dt * s.g_V) - imu.deltas().dp,
        R_BV * (s.v[k + 1] - s.v[k] - dt * s.g_V) - imu.deltas().dv;
    const Eigen::Matrix<double, 6, 6> covariance =
        c.preintegrations[k].covariance().block<6, 6>(3, 3);
    r.segment<6>(6 * k) = Eigen::LLT<Eigen::Matrix<double, 6, 6>>(covariance).matrixL().solve(e);
  }
  r.tail<3>() = (s.b_a - mean) / sigma;
  return r;
}

LinearState disturbed(const LinearState& truth) {
  LinearState state = truth;
  for (size_t k = 0; k < state.p.size(); ++k) {
    state.p[k] += Vector3d(0.1, -0.2, 0.3);
    state.v[k] += 0.1 * static_cast<double>(k) * Vector3d(-0.3, 0.2, 0.1);
  }
  state.g_V = expSO3(Vector3d(0.1, -0.2, 0.05)) * state.g_V;
  state.b_a += Vector3d(0.2, 0.1, -0.1);
  return state;
}

TEST(DrtImuAlignment, HessianAndGradientAreThoseOfTheEquationsByNumericalDerivatives) {
  const Vector3d mean(0.05, -0.02, 0.01);
  for (const Motion motion : {Motion::kAggressive, Motion::kCircle, Motion::kStandstill}) {
    SCOPED_TRACE(testing::toString(motion));
    const Case c(motion);
    const ImuAlignment alignment = c.alignment(mean, 0.1);
    const LinearState state = disturbed(c.truth);
    MatrixXd H = MatrixXd::Zero(alignment.size(), alignment.size());
    VectorXd gradient = VectorXd::Zero(alignment.size());
    alignment.addTo(state, &H, &gradient);

    const VectorXd r = residuals(c, state, mean, 0.1);
    const VectorXd here = VectorXd::Zero(alignment.size());
    const MatrixXd J = testing::numericalJacobian(
        [&](const VectorXd& d) { return residuals(c, alignment.moved(state, d), mean, 0.1); }, here,
        1e-5);
    // The step leaves 1e-10 of curvature (gravity) and 1e-11 of rounding, times residuals of 1e3.
    EXPECT_LT((H - J.transpose() * J).norm(), 1e-6 * H.norm());
    EXPECT_LT((gradient - J.transpose() * r).norm(), 1e-6 * gradient.norm());
  }
}

TEST(DrtImuAlignment, NothingPullsAtTheTruth) {
  const Case c(Motion::kAggressive);
  const ImuAlignment alignment = c.alignment(c.truth.b_a, 0.1);
  MatrixXd H = MatrixXd::Zero(alignment.size(), alignment.size());
  VectorXd gradient = VectorXd::Zero(alignment.size());
  alignment.addTo(c.truth, &H, &gradient);
  const VectorXd step = (H + 1e-6 * MatrixXd::Identity(H.rows(), H.cols())).ldlt().solve(gradient);
  EXPECT_LT(step.norm(), 1e-8);
}

TEST(DrtImuAlignment, FindsTheTruthWhereThePositionsAreGiven) {
  const Case c(Motion::kAggressive);
  const ImuAlignment alignment = c.alignment(Vector3d::Zero(), 1e5);
  LinearState state = alignment.start();
  state.p = c.truth.p;
  const Index n = 3 * state.p.size(), others = alignment.size() - n;
  for (int iteration = 0; iteration < 20; ++iteration) {
    MatrixXd H = MatrixXd::Zero(alignment.size(), alignment.size());
    VectorXd gradient = VectorXd::Zero(alignment.size());
    alignment.addTo(state, &H, &gradient);
    VectorXd step = VectorXd::Zero(alignment.size());
    step.tail(others) = H.bottomRightCorner(others, others).ldlt().solve(-gradient.tail(others));
    state = alignment.moved(state, step);
  }
  EXPECT_LT((state.g_V - c.truth.g_V).norm(), 1e-6);
  EXPECT_LT((state.b_a - c.truth.b_a).norm(), 1e-6);
  for (size_t k = 0; k < state.v.size(); ++k) EXPECT_LT((state.v[k] - c.truth.v[k]).norm(), 1e-6);
}

TEST(DrtImuAlignment, WithoutFreedomTheAccelerometerBiasStaysAtItsMean) {
  const Case c(Motion::kAggressive);
  const Vector3d mean(0.3, 0.2, -0.1);
  const ImuAlignment alignment = c.alignment(mean, 0.0);
  LinearState state = alignment.start();
  EXPECT_EQ(state.b_a, mean);
  MatrixXd H = MatrixXd::Zero(alignment.size(), alignment.size());
  VectorXd gradient = VectorXd::Zero(alignment.size());
  state.p = c.truth.p;
  alignment.addTo(state, &H, &gradient);
  const Index n = alignment.size() - 3;
  const VectorXd step = H.bottomRightCorner(n, n).ldlt().solve(-gradient.tail(n));
  EXPECT_LT(step.tail<3>().norm(), 1e-9);
  EXPECT_GT(step.norm(), 0.1);
}

TEST(DrtImuAlignment, StartsFromRestWithGravityAgainstTheAccelerometer) {
  Case c(Motion::kStandstill);
  const LinearState still = c.alignment(c.truth.b_a, 0.1).start();
  // The deltas were integrated without the bias, so the whole mean force is taken for gravity.
  const Vector3d force = c.window.imu.samples().front().accel;
  EXPECT_LT((still.g_V + kGravity * force.normalized()).norm(), 1e-9);
  // The excess of the force over gravity changes the velocity by (|f| - g) t along f.
  const double t =
      secondsBetween(c.preintegrations.front().start(), c.preintegrations.back().end());
  const Vector3d v = (force.norm() - kGravity) * t * force.normalized();
  EXPECT_LT((still.v.back() - v).norm(), 1e-9);
  EXPECT_LT((still.p.back() - 0.5 * t * v).norm(), 1e-9);
}

TEST(DrtImuAlignment, MovesGravityOnItsSphere) {
  const Case c(Motion::kAggressive);
  const ImuAlignment alignment = c.alignment(Vector3d::Zero(), 0.1);
  VectorXd step = VectorXd::Zero(alignment.size());
  step(alignment.size() - 5) = 0.2;
  step(0) = 1.0;
  const LinearState moved = alignment.moved(c.truth, step);
  EXPECT_NEAR(moved.g_V.norm(), kGravity, 1e-12);
  EXPECT_NEAR(angleBetween(moved.g_V, c.truth.g_V), std::atan(0.2), 1e-9);
  EXPECT_EQ(moved.p[0], c.truth.p[0] + Vector3d::UnitX());
  EXPECT_EQ(moved.v, c.truth.v);
}

}  // namespace
}  // namespace etalon::plugins
