// The parts of the fixed-lag window: residuals, solver and prior against what they must equal.

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <deque>

#include "../src/fixed_lag/sliding.h"
#include "../src/fixed_lag/tracks.h"
#include "../src/fixed_lag/window_solver.h"
#include "etalon/core/so3.h"
#include "simulated_flight.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::Map;
using Eigen::Vector3d;

SimulatedFlight shortFlight(double duration_s, double outlier_ratio = 0.0) {
  SimulatedFlightOptions options;
  options.duration_s = duration_s;
  options.tracks = 60;
  options.outlier_ratio = outlier_ratio;
  return simulateFlight(options);
}

/** Next frame of the flight in the window: tracks, and landmarks if it is to be a keyframe. */
void addFrame(const SimulatedFlight& flight, size_t from, size_t to, bool keyframe, Tracks* tracks,
              Window* window) {
  appendState(
      Preintegration(flight.between(from, to), window->states.back().now.bias, flight.imu_noise),
      window);
  const MeasuredFrame measured = measure(flight.calibration, flight.frames[to], 0.35);
  tracks->associate(measured, 1e-4 * Eigen::Matrix<double, 6, 6>::Identity(), window);
  window->states.back().keyframe = keyframe;
  if (keyframe) tracks->createLandmarks(measured, window);
}

/** Weights of the start's error; nothing is known of position and yaw, nor of the velocity. */
Matrix15d withoutGauge(const NavState& start) {
  Matrix15d L = Matrix15d::Zero();
  L.block<2, 3>(0, 0) = 100.0 * start.T_WB.R.topRows<2>();  // tilt, rad
  L.block<3, 3>(9, 9).diagonal().setConstant(500.0);
  L.block<3, 3>(12, 12).diagonal().setConstant(30.0);
  return L;
}

TEST(FixedLagWindow, RelativeJacobiansAgreeWithDifferences) {
  const SE3 T_WH(expSO3({0.3, -1.2, 0.5}), {1, 2, 3}), T_WT(expSO3({-0.8, 0.2, 1.5}), {-1, 0.5, 2});
  const RelativeJacobians J = relativeJacobians(T_WH, T_WT);
  const double h = 1e-6;
  for (int side = 0; side < 2; ++side)
    for (int c = 0; c < 6; ++c) {
      Eigen::Matrix<double, 6, 1> numerical;
      const auto moved = [&](double d) {
        NavState a;
        a.T_WB = side == 0 ? T_WT : T_WH;
        const SE3 T = a.plus(d * Vector15d::Unit(c)).T_WB;
        return side == 0 ? relativePose(T_WH, T) : relativePose(T, T_WT);
      };
      const SE3 plus = moved(h), minus = moved(-h);
      numerical << logSO3(minus.R.transpose() * plus.R), plus.t - minus.t;
      numerical /= 2 * h;
      const auto& analytic = side == 0 ? J.by_target : J.by_host;
      EXPECT_LT((analytic.col(c) - numerical).norm(), 1e-8) << side << c;
    }
}

// The same cost in Ceres, by numerical derivatives: residuals of pixels, IMU and prior.
struct PixelCost {
  const SE3* T_CB;
  const ReprojectionMeasurement* m;
  InverseDepthLandmark landmark;
  bool operator()(const double* q_h, const double* p_h, const double* q_t, const double* p_t,
                  const double* l, double* r) const {
    const SE3 T_WH(Map<const Eigen::Quaterniond>(q_h).toRotationMatrix(), Map<const Vector3d>(p_h));
    const SE3 T_WT(Map<const Eigen::Quaterniond>(q_t).toRotationMatrix(), Map<const Vector3d>(p_t));
    InverseDepthLandmark moved = landmark;
    moved.parameters = Map<const Vector3d>(l);
    Eigen::Vector2d residual;
    if (!reprojectionResidual(*T_CB, *m, relativePose(T_WH, T_WT), moved, &residual)) return false;
    Map<Eigen::Vector2d>{r} = residual;
    return true;
  }
};
struct HostPixelCost {
  PixelCost cost;
  bool operator()(const double* l, double* r) const {
    const double q[] = {0, 0, 0, 1}, p[] = {0, 0, 0};
    return cost(q, p, q, p, l, r);
  }
};
NavState stateOf(const double* q, const double* p, const double* rest) {
  NavState s;
  s.T_WB = {Map<const Eigen::Quaterniond>(q).toRotationMatrix(), Map<const Vector3d>(p)};
  s.v_WB = Map<const Vector3d>(rest);
  s.bias = {Map<const Vector3d>(rest + 3), Map<const Vector3d>(rest + 6)};
  return s;
}
struct InertialCost {
  const WindowState* to;
  Vector3d g_W;
  bool operator()(const double* q_i, const double* p_i, const double* x_i, const double* q_j,
                  const double* p_j, const double* x_j, double* r) const {
    Map<Vector15d>{r} = to->imu_sqrt_information * inertialResidual(to->imu, stateOf(q_i, p_i, x_i),
                                                                    stateOf(q_j, p_j, x_j), g_W);
    return true;
  }
};
struct PriorCost {
  const WindowState* first;
  Matrix15d L;
  bool operator()(const double* q, const double* p, const double* x, double* r) const {
    Map<Vector15d>{r} = L * stateOf(q, p, x).minus(first->linearization);
    return true;
  }
};

/** A window as Ceres' parameter blocks. */
struct Blocks {
  struct State {
    Eigen::Quaterniond q;
    Vector3d p;
    Eigen::Matrix<double, 9, 1> rest;  // velocity, b_g, b_a
  };
  std::vector<State> states;
  std::deque<Vector3d> landmarks;

  explicit Blocks(const Window& window) {
    for (const WindowState& s : window.states) {
      State block{Eigen::Quaterniond(s.now.T_WB.R), s.now.T_WB.t, {}};
      block.rest << s.now.v_WB, s.now.bias.gyro, s.now.bias.accel;
      states.push_back(block);
    }
    for (const auto& [id, landmark] : window.landmarks)
      landmarks.push_back(landmark.in_host.parameters);
  }

  double solve(const Window& window, const Matrix15d& L) {
    using namespace ceres;
    Problem problem;
    for (State& s : states) {
      problem.AddParameterBlock(s.q.coeffs().data(), 4, new EigenQuaternionManifold);
      problem.AddParameterBlock(s.p.data(), 3);
    }
    problem.AddResidualBlock(new NumericDiffCostFunction<PriorCost, CENTRAL, 15, 4, 3, 9>(
                                 new PriorCost{&window.states[0], L}),
                             nullptr, states[0].q.coeffs().data(), states[0].p.data(),
                             states[0].rest.data());
    for (size_t i = 1; i < states.size(); ++i)
      problem.AddResidualBlock(
          new NumericDiffCostFunction<InertialCost, CENTRAL, 15, 4, 3, 9, 4, 3, 9>(
              new InertialCost{&window.states[i], window.g_W}),
          nullptr, states[i - 1].q.coeffs().data(), states[i - 1].p.data(),
          states[i - 1].rest.data(), states[i].q.coeffs().data(), states[i].p.data(),
          states[i].rest.data());
    auto parameters = landmarks.begin();
    for (const auto& [id, landmark] : window.landmarks) {
      double* l = (parameters++)->data();
      if (landmark.observations.size() < 2) continue;  // tells of no state
      for (const LandmarkObservation& o : landmark.observations)
        for (size_t camera = 0; camera < (o.has_right ? 2u : 1u); ++camera) {
          const PixelCost cost{&window.T_CB[camera], &o.measurements[camera], landmark.in_host};
          State &h = states[landmark.host], &t = states[o.state];
          auto* loss =
              new ScaledLoss(new CauchyLoss(std::sqrt(kCauchyChi2)), kCauchyGain, TAKE_OWNERSHIP);
          if (o.state == landmark.host)
            problem.AddResidualBlock(
                new NumericDiffCostFunction<HostPixelCost, CENTRAL, 2, 3>(new HostPixelCost{cost}),
                loss, l);
          else
            problem.AddResidualBlock(
                new NumericDiffCostFunction<PixelCost, CENTRAL, 2, 4, 3, 4, 3, 3>(
                    new PixelCost(cost)),
                loss, h.q.coeffs().data(), h.p.data(), t.q.coeffs().data(), t.p.data(), l);
        }
    }
    Solver::Options options;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-14;
    options.linear_solver_type = DENSE_SCHUR;
    Solver::Summary summary;
    Solve(options, &problem, &summary);
    return 2.0 * summary.final_cost;
  }
};

TEST(FixedLagWindow, HasTheMinimumThatCeresFinds) {
  // Every fourth frame, all states full; one track in twenty is wrong in a frame, so that the
  // robust loss is at work.
  const SimulatedFlight flight = shortFlight(1.2, 0.05);
  TrackOptions track_options;
  track_options.chi2_gate = 1e9;
  Tracks tracks(flight.calibration, track_options);
  const Matrix15d L = Vector15d(startSigma().cwiseInverse()).asDiagonal();
  Window window =
      windowAt(flight.calibration, {0, 0, -9.81}, flight.truth[0], flight.frames[0].t, L);
  tracks.createLandmarks(measure(flight.calibration, flight.frames[0], 0.35), &window);
  for (size_t i = 4; i <= 20; i += 4) addFrame(flight, i - 4, i, i == 8, &tracks, &window);
  // The prior's derivatives are taken at its linearisation point, and Ceres' where the state is:
  // without fixed states both are the same but for the curvature of the rotation's logarithm.
  Blocks blocks(window);
  const double expected = blocks.solve(window, L);
  SolverOptions options;
  options.iterations = 50;
  options.converged_sigmas = 1e-7;
  const SolverResult result = WindowSolver(options).solve(&window, options.iterations, false);
  EXPECT_TRUE(result.converged);
  EXPECT_NEAR(result.cost, expected, 1e-4 * expected);
  for (size_t i = 0; i < window.states.size(); ++i) {
    const Blocks::State& ceres_state = blocks.states[i];
    const NavState other =
        stateOf(ceres_state.q.coeffs().data(), ceres_state.p.data(), ceres_state.rest.data());
    // In standard deviations of a start: far below what the data can tell.
    const Vector15d d = window.states[i].now.minus(other);
    EXPECT_LT(d.cwiseQuotient(startSigma()).cwiseAbs().maxCoeff(), 0.01) << i << ": " << d;
  }
}

/** Directions of the first columns in which all states move or turn together. */
Eigen::MatrixXd gaugeDirections(const Window& window) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(window.prior.unknowns(), 4);
  for (const WindowState& state : window.states) {
    if (state.column >= N.rows()) break;
    const NavState& at = state.linearization;
    N.block<3, 3>(state.column + 3, 0).setIdentity();
    N.block<3, 1>(state.column, 3) = at.T_WB.R.transpose().col(2);
    N.block<3, 1>(state.column + 3, 3) = Vector3d::UnitZ().cross(at.T_WB.t);
    if (state.full) N.block<3, 1>(state.column + 6, 3) = Vector3d::UnitZ().cross(at.v_WB);
  }
  return N;
}

class FixedLagPrior : public ::testing::TestWithParam<bool> {};

TEST_P(FixedLagPrior, CostsNothingAlongPositionAndYaw) {
  const SimulatedFlight flight = shortFlight(6.0);
  Tracks tracks(flight.calibration, {});
  NavState start = flight.startAt(0, startSigma(), 1).state;
  Window window =
      windowAt(flight.calibration, {0, 0, -9.81}, start, flight.frames[0].t, withoutGauge(start));
  if (GetParam()) addCalibrationColumns(flight.calibration, &window);
  tracks.createLandmarks(measure(flight.calibration, flight.frames[0], 0.35), &window);
  WindowSolver solver({});
  for (size_t i = 1; i < flight.frames.size(); ++i) {
    addFrame(flight, i - 1, i, i % 6 == 0, &tracks, &window);
    solver.solve(&window, SolverOptions().iterations, false);
    tracks.dropOutliers(RelativeViews(window), &window);
    slide({}, &window);
  }
  ASSERT_GE(window.prior.unknowns(), 7 * 6 + 15);
  const Eigen::VectorXd cost = (window.prior.A * gaugeDirections(window)).colwise().squaredNorm();
  const Eigen::MatrixXd H = window.prior.A.transpose() * window.prior.A;
  EXPECT_GT(H.diagonal().minCoeff(), 100.0);  // of every unknown alone
  // A metre or a radian of all together costs a billionth of that: rounding, 100 times repeated.
  EXPECT_LT(cost.maxCoeff(), 1e-5) << cost.transpose();
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutCalibration, FixedLagPrior, ::testing::Bool());

}  // namespace
}  // namespace etalon::fixed_lag
