// The pixels' part of the fixed-lag odometry's equations, against differences of its cost.

#include <gtest/gtest.h>

#include "../src/fixed_lag/visual_terms.h"
#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/expect_jacobian.h"
#include "point_scene.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/** Four states around twelve points, states and landmarks a little off. */
struct Scene : PointScene {
  std::vector<Landmark*> landmarks;

  explicit Scene(double off = 1.0) : PointScene(12) {
    Tracks tracks(calibration, {});
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    for (int k = 1; k < 4; ++k) {
      append({expSO3({0.01 * k, -0.02 * k, 0.03 * k}), {0.1 * k, -0.05 * k, 0.02 * k}});
      tracks.associate(measured(seeFromNewest()), 1e-2 * Eigen::Matrix<double, 6, 6>::Identity(),
                       &window);
    }
    std::mt19937 random(1);
    std::normal_distribution<double> unit;
    const auto normal = [&unit, off](std::mt19937& from) { return off * unit(from); };
    for (size_t i = 0; i < window.states.size(); ++i) {
      Vector15d d = Vector15d::Zero();
      for (int c = 0; c < 6; ++c) d[c] = 2e-3 * normal(random);
      window.states[i].now = window.states[i].linearization = window.states[i].now.plus(d);
      window.states[i].fixed = false;
    }
    for (auto& [id, landmark] : window.landmarks) {
      for (int c = 0; c < 3; ++c) landmark.in_host.parameters[c] += 1e-3 * normal(random);
      landmarks.push_back(&landmark);
    }
  }

  /** The cost with the states moved by `step`, landmarks where they are. */
  double costAt(const VectorXd& step) const {
    Window moved = window;
    for (WindowState& state : moved.states) {
      Vector15d d = Vector15d::Zero();
      d.head(state.size()) = step.segment(state.column, state.size());
      state.now = state.now.plus(d);
    }
    return VisualTerms().cost(moved, landmarks);
  }
  NormalEquations linearized(VisualTerms* terms) {
    NormalEquations equations(window.unknowns());
    terms->linearize(window, landmarks, static_cast<int>(window.states.size()) - 1, &equations);
    return equations;
  }
};

TEST(VisualTerms, TheLinearisationHasTheCostThatIsAskedForAlone) {
  Scene scene;
  VisualTerms terms;
  const double cost = terms.cost(scene.window, scene.landmarks);
  EXPECT_GT(cost, 10.0);
  EXPECT_NEAR(scene.linearized(&terms).cost, cost, 1e-9 * cost);
  // 0 with exact states and landmarks.
  Scene exact(0.0);
  EXPECT_LT(VisualTerms().cost(exact.window, exact.landmarks), 1e-6);
}

TEST(VisualTerms, TheGradientIsThatOfTheCostOnceLandmarksAreBest) {
  // Where the landmarks' own gradient is zero, the eliminated equations' is that of the cost.
  Scene scene;
  VisualTerms terms;
  for (int k = 0; k < 40; ++k) {
    scene.linearized(&terms);
    terms.solveLandmarks(scene.window, VectorXd::Zero(scene.window.unknowns()));
  }
  const NormalEquations equations = scene.linearized(&terms);
  const auto cost = [&](const Eigen::VectorXd& step) { return scene.costAt(step); };
  const VectorXd zero = VectorXd::Zero(scene.window.unknowns());
  // The cost is x^T H x + 2 g^T x + cost.
  for (Eigen::Index c = 0; c < zero.size(); ++c) {
    const double h = 1e-5;
    const VectorXd e = VectorXd::Unit(zero.size(), c);
    const double numerical = (cost(h * e) - cost(-h * e)) / (4.0 * h);
    EXPECT_NEAR(equations.g[c], numerical, 1e-4 * equations.g.norm()) << c;
  }
}

/** Gradient and cost by updateGradient(). */
NormalEquations updated(const Window& window, VisualTerms* terms) {
  NormalEquations equations = NormalEquations::gradientOf(window.unknowns());
  terms->updateGradient(window, &equations);
  return equations;
}

TEST(VisualTerms, TheGradientIsUpdatedToThatOfALinearisation) {
  Scene scene(0.1);
  VisualTerms terms;
  VectorXd step = VectorXd::Zero(scene.window.unknowns());
  for (int k = 0; k < 20; ++k) {
    scene.linearized(&terms);
    terms.solveLandmarks(scene.window, step);
  }
  const NormalEquations before = scene.linearized(&terms);
  const NormalEquations same = updated(scene.window, &terms);
  EXPECT_EQ(same.H.size(), 0);
  EXPECT_NEAR(same.cost, before.cost, 1e-9 * before.cost);
  EXPECT_LT((same.g - before.g).norm(), 1e-9 * before.g.norm());
  // After a step: but for what is of second order, in the landmarks' elimination.
  for (WindowState& state : scene.window.states) {
    step.segment<6>(state.column) << Vector3d(1e-4, -2e-4, 1e-4) * state.serial,
        Vector3d(2e-4, 1e-4, -1e-4) * (1 - state.serial);
    Vector15d d = Vector15d::Zero();
    d.head<6>() = step.segment<6>(state.column);
    state.now = state.now.plus(d);
  }
  terms.solveLandmarks(scene.window, step);
  for (WindowState& state : scene.window.states) state.linearization = state.now;
  const NormalEquations moved = updated(scene.window, &terms);
  const NormalEquations exact = scene.linearized(&terms);
  EXPECT_NEAR(moved.cost, exact.cost, 1e-9 * exact.cost);
  EXPECT_GT((exact.g - before.g).norm(), 0.01 * exact.g.norm());
  EXPECT_LT((moved.g - exact.g).norm(), 0.05 * (exact.g - before.g).norm());
}

TEST(VisualTerms, OnlyPosesAreTouchedAndTheEquationsAreSymmetric) {
  Scene scene;
  VisualTerms terms;
  const NormalEquations equations = scene.linearized(&terms);
  const MatrixXd& H = equations.H;
  EXPECT_LT((H - H.transpose()).norm(), 1e-9 * H.norm());
  for (const WindowState& state : scene.window.states) {
    EXPECT_GT(H.diagonal().segment(state.column, 6).minCoeff(), 0.0);
    EXPECT_EQ(H.middleCols(state.column + 6, state.size() - 6).norm(), 0.0);
    EXPECT_EQ(equations.g.segment(state.column + 6, state.size() - 6).norm(), 0.0);
  }
  const VectorXd eigenvalues = symmetricEigenvalues(H);
  EXPECT_GT(eigenvalues.minCoeff(), -1e-9 * eigenvalues.maxCoeff());
}

TEST(VisualTerms, TurningAndMovingEverythingCostsNothing) {
  // All six directions: pixels know nothing of gravity. Linearisation points are elsewhere.
  Scene scene;
  for (size_t i = 0; i < scene.window.states.size(); ++i) {
    WindowState& state = scene.window.states[i];
    state.fixed = true;
    state.linearization = state.now.plus(0.05 * Vector15d::Constant(i % 2 ? 1.0 : -1.0));
  }
  VisualTerms terms;
  const NormalEquations equations = scene.linearized(&terms);
  MatrixXd N = MatrixXd::Zero(scene.window.unknowns(), 6);
  for (const WindowState& state : scene.window.states) {
    const SE3& T_WB = state.linearization.T_WB;
    N.block<3, 3>(state.column, 0) = T_WB.R.transpose();
    N.block<3, 3>(state.column + 3, 0) = -hat(T_WB.t);
    N.block<3, 3>(state.column + 3, 3).setIdentity();
  }
  EXPECT_LT((equations.H * N).norm(), 1e-9 * equations.H.norm());
  EXPECT_LT((N.transpose() * equations.g).norm(), 1e-9 * equations.g.norm());
}

TEST(VisualTerms, LaterObservationsAreLeftOut) {
  Scene scene;
  VisualTerms terms;
  NormalEquations first(scene.window.unknowns());
  terms.linearize(scene.window, scene.landmarks, 1, &first);
  EXPECT_GT(first.H.block(0, 0, 6, 6).norm(), 0.0);
  EXPECT_GT(first.H.block(15, 15, 6, 6).norm(), 0.0);
  EXPECT_EQ(first.H.bottomRows(30).norm(), 0.0);
  // As if they were not there.
  for (Landmark* landmark : scene.landmarks) landmark->observations.resize(2);
  const NormalEquations second = scene.linearized(&terms);
  EXPECT_EQ(first.H, second.H);
  EXPECT_EQ(first.cost, second.cost);
}

TEST(VisualTerms, NoiserPixelsWeighLess) {
  // A cost whose residuals are a thousandth of the loss's scale is quadratic.
  Scene one(1e-3), four(1e-3);
  four.window.pixel_variance = 4.0;
  VisualTerms terms;
  const NormalEquations a = one.linearized(&terms), b = four.linearized(&terms);
  EXPECT_LT((a.H - 4.0 * b.H).norm(), 1e-4 * a.H.norm());
  EXPECT_NEAR(a.cost, 4.0 * b.cost, 1e-4 * a.cost);
}

TEST(VisualTerms, ALandmarkAtInfinityThatWantsFartherStaysThere) {
  Scene scene(0.0);
  Landmark& landmark = *scene.landmarks.front();
  // Seen with less parallax than infinity has: the distance would be negative.
  for (LandmarkObservation& o : landmark.observations)
    if (o.state != landmark.host)
      for (size_t c = 0; c < 2; ++c) {
        const Vector3d t = scene.window.states[o.state].now.T_WB.t;
        const SE3 T_HT(scene.window.states[o.state].now.T_WB.R, -t);
        const Vector3d p = (T_HT * scene.calibration.cameras[c].T_BC).inverse() * scene.points[0];
        const CameraModel& camera = scene.calibration.cameras[c].model;
        o.measurements[c] = *makeMeasurement(camera, *camera.project(p), PointScene::kSigmaPx);
      }
  landmark.in_host.parameters.z() = 0.0;
  VisualTerms terms;
  scene.linearized(&terms);
  const VectorXd zero = VectorXd::Zero(scene.window.unknowns());
  for (int k = 0; k < 5; ++k) {
    terms.solveLandmarks(scene.window, zero);
    EXPECT_GE(landmark.in_host.parameters.z(), 0.0);
    scene.linearized(&terms);
    // The pixels say how far it may be all the same.
    EXPECT_GT(landmark.covariance(2, 2), 0.0);
    EXPECT_LT(landmark.covariance(2, 2), 0.01);  // 1 / m^2
  }
}

TEST(VisualTerms, LandmarksFollowAStepOfTheStates) {
  // To where they end up by themselves, but for the curvature: a hundredth of the way. Residuals are
  // far below the loss's scale, so that the cost is quadratic.
  Scene scene(1e-3);
  VisualTerms terms;
  const VectorXd zero = VectorXd::Zero(scene.window.unknowns());
  const auto settle = [&] {
    for (int k = 0; k < 20; ++k) {
      scene.linearized(&terms);
      terms.solveLandmarks(scene.window, zero);
    }
    std::vector<Vector3d> parameters;
    for (const Landmark* landmark : scene.landmarks)
      parameters.push_back(landmark->in_host.parameters);
    return parameters;
  };
  const std::vector<Vector3d> before = settle();
  VectorXd step = zero;
  for (const WindowState& state : scene.window.states)
    step.segment<6>(state.column) << Vector3d(1e-4, -2e-4, 1e-4) * state.serial,
        Vector3d(2e-4, 1e-4, -1e-4) * (1 - state.serial);
  scene.linearized(&terms);
  terms.solveLandmarks(scene.window, step);
  std::vector<Vector3d> followed;
  for (const Landmark* landmark : scene.landmarks) followed.push_back(landmark->in_host.parameters);
  for (WindowState& state : scene.window.states) {
    Vector15d d = Vector15d::Zero();
    d.head<6>() = step.segment<6>(state.column);
    state.now = state.linearization = state.now.plus(d);
  }
  const std::vector<Vector3d> after = settle();
  for (size_t l = 0; l < after.size(); ++l) {
    EXPECT_GT((after[l] - before[l]).norm(), 1e-5) << l;
    EXPECT_LT((after[l] - followed[l]).norm(), 0.01 * (after[l] - before[l]).norm()) << l;
  }
}

TEST(RobustCost, IsTheSumOfLogarithmsHoweverManyAndHoweverLarge) {
  RobustCost cost;
  double expected = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double r2 = i % 100 == 0 ? 1e12 : 0.01 * i;
    const double weight = cost.add(r2);
    // The weight is the derivative of the cost by r^2.
    EXPECT_NEAR(weight, kCauchyGain / (1.0 + r2 / kCauchyChi2), 1e-15);
    expected += kCauchyGain * kCauchyChi2 * std::log1p(r2 / kCauchyChi2);
  }
  EXPECT_NEAR(cost.total(), expected, 1e-9 * expected);
  EXPECT_EQ(RobustCost().total(), 0.0);
}

}  // namespace
}  // namespace etalon::fixed_lag
