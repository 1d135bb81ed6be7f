// The fixed-lag odometry with a map: old keyframes in the window, found again.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <set>

#include "../src/fixed_lag/recall.h"
#include "../src/fixed_lag/sliding.h"
#include "../src/fixed_lag/tracks.h"
#include "simulated_views.h"

namespace etalon {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using fixed_lag::Matrix15d;

FixedLagOptions mapOptionsFor(const SimulatedFlight& flight) {
  FixedLagOptions options;
  options.imu_noise = flight.imu_noise;
  return options;
}

SimulatedFlight flight(std::uint64_t seed, double duration_s = 30.0) {
  SimulatedFlightOptions options;
  options.seed = seed;
  options.duration_s = duration_s;
  options.frame_rate_hz = 10.0;
  options.tracks = 60;
  return simulateFlight(options);
}

std::vector<OdometryOutput> fly(const SimulatedFlight& flown, const MapOptions& map,
                                std::shared_ptr<ViewMatcher> views) {
  FixedLagOdometry odometry(flown.calibration, mapOptionsFor(flown), map, std::move(views));
  std::vector<OdometryOutput> outputs;
  for (size_t i = 0; i < flown.frames.size(); ++i)
    outputs.push_back(i == 0 ? odometry.start(flown.startAt(0, startSigma(), 7), flown.frames[0])
                             : odometry.process(flown.frames[i], flown.between(i - 1, i)));
  return outputs;
}

/** RMS error of the position in the last `seconds`, m. */
double lateError(const std::vector<OdometryOutput>& outputs, const SimulatedFlight& flown,
                 double seconds) {
  double squares = 0.0;
  int count = 0;
  for (size_t i = 0; i < outputs.size(); ++i)
    if (secondsBetween(outputs[i].t, outputs.back().t) < seconds) {
      squares += (outputs[i].state.T_WB.t - flown.truth[i].T_WB.t).squaredNorm();
      ++count;
    }
  return std::sqrt(squares / count);
}

int foundAgain(const std::vector<OdometryOutput>& outputs) {
  int count = 0;
  for (const OdometryOutput& out : outputs) count += static_cast<int>(out.recalled.size());
  return count;
}

TEST(OdometryWithMap, AKeyframeThatStaysEqualsTheFullBatch) {
  // A chain of numbers, each measured against its neighbour. The first one stays while those between
  // are marginalised one by one; at the end the last one is measured against it.
  constexpr Eigen::Index kLength = 8;
  LinearRows batch(kLength + 1, kLength);
  batch.A(0, 0) = 3.0;
  for (Eigen::Index i = 1; i < kLength; ++i) {
    batch.A(i, i) = 2.0 + 0.1 * static_cast<double>(i);
    batch.A(i, i - 1) = -batch.A(i, i);
    batch.b[i] = 0.3 * static_cast<double>(i % 3) - 1.0;
  }
  batch.A(kLength, kLength - 1) = 5.0;
  batch.A(kLength, 0) = -5.0;
  batch.b[kLength] = 0.7;
  const Eigen::VectorXd expected = batch.A.colPivHouseholderQr().solve(-batch.b);

  LinearRows prior(2, 2);  // of [first, newest]
  prior.A = batch.A.topLeftCorner<2, 2>();
  prior.b = batch.b.head<2>();
  for (Eigen::Index i = 2; i < kLength; ++i) {
    LinearRows rows(prior.rows() + 1, 3);  // of [leaving, first, newest]
    rows.A.topLeftCorner(prior.rows(), 1) = prior.A.col(1);
    rows.A.block(0, 1, prior.rows(), 1) = prior.A.col(0);
    rows.A(prior.rows(), 0) = batch.A(i, i - 1);
    rows.A(prior.rows(), 2) = batch.A(i, i);
    rows.b << prior.b, batch.b[i];
    prior = marginalizeFirst(rows, 1);
  }
  Eigen::MatrixXd A(prior.rows() + 1, 2);
  A << prior.A, -5.0, 5.0;
  Eigen::VectorXd b(prior.rows() + 1);
  b << prior.b, 0.7;
  const Eigen::VectorXd found = A.colPivHouseholderQr().solve(-b);
  EXPECT_NEAR(found[0], expected[0], 1e-12);
  EXPECT_NEAR(found[1], expected[kLength - 1], 1e-12);
}

TEST(OdometryWithMap, KeyframesInThePriorAloneFollowTheOthers) {
  // The same window with and without their elimination before the others.
  const SimulatedFlight flown = flight(3, 14.0);
  fixed_lag::Tracks tracks(flown.calibration, {});
  const fixed_lag::Matrix15d L = fixed_lag::Vector15d(startSigma().cwiseInverse()).asDiagonal();
  fixed_lag::Window window =
      fixed_lag::windowAt(flown.calibration, {0, 0, -9.81}, flown.startAt(0, startSigma(), 1).state,
                          flown.frames[0].t, L);
  tracks.createLandmarks(fixed_lag::measure(flown.calibration, flown.frames[0], 0.35), &window);
  fixed_lag::SolverOptions options;
  options.iterations = 10;
  options.converged_sigmas = 1e-6;
  const auto add = [&](size_t i) {
    appendState(
        Preintegration(flown.between(i - 1, i), window.states.back().now.bias, flown.imu_noise),
        &window);
    const auto measured = fixed_lag::measure(flown.calibration, flown.frames[i], 0.35);
    tracks.associate(measured, 1e-4 * Eigen::Matrix<double, 6, 6>::Identity(), &window);
    window.states.back().keyframe = window.states.back().is_view = i % 2 == 0;
    if (i % 2 == 0) tracks.createLandmarks(measured, &window);
  };
  for (size_t i = 1; i + 1 < flown.frames.size(); ++i) {
    add(i);
    fixed_lag::WindowSolver({}).solve(&window, fixed_lag::SolverOptions().iterations, false);
    slide({}, &window);
  }
  add(flown.frames.size() - 1);
  ASSERT_GE(window.retainedCount(), 10u);
  std::set<int> seen_in;  // states in which a landmark of the window is seen
  for (const auto& [id, landmark] : window.landmarks)
    for (const auto& o : landmark.observations) seen_in.insert(o.state);
  ASSERT_LT(seen_in.size(), window.states.size());
  fixed_lag::Window plain = window;
  for (fixed_lag::WindowState& state : plain.states) state.retained = false;
  fixed_lag::WindowSolver one(options), other(options);
  const auto a = one.solve(&window, options.iterations, false);
  const auto b = other.solve(&plain, options.iterations, false);
  EXPECT_NEAR(a.cost, b.cost, 1e-6 * b.cost);
  const Eigen::VectorXd sigma = b.covariance.diagonal().cwiseSqrt();
  for (size_t i = 0; i < window.states.size(); ++i) {
    // In the newest state's standard deviations.
    const Eigen::VectorXd d = window.states[i].now.minus(plain.states[i].now);
    EXPECT_LT(d.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-4) << i;
  }
  std::vector<Eigen::Index> unknowns;
  for (const fixed_lag::WindowState& state : window.states)
    for (Eigen::Index c = 0; c < 6 && state.retained; ++c) unknowns.push_back(state.column + c);
  for (Eigen::Index c = 0; c < 6; ++c) unknowns.push_back(window.states.back().column + c);
  const Eigen::MatrixXd P = one.covariance(unknowns), Q = other.covariance(unknowns);
  const Eigen::VectorXd scale = Q.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (P - Q) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-4);
  // What one state is off by against another is a hundredth of what both are off by together: the
  // same in every direction.
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(Q.rows(), Q.cols());
  const Eigen::MatrixXd L_inverse = Eigen::LLT<Eigen::MatrixXd>(Q).matrixL().solve(I);
  EXPECT_LT((L_inverse * P * L_inverse.transpose() - I).norm(), 0.01);
}

TEST(OdometryWithMap, OffIsTheOdometryWithoutOneToTheBit) {
  const SimulatedFlight flown = flight(1, 8.0);
  MapOptions off;
  off.enabled = false;
  const auto without = fly(flown, {}, nullptr);
  const auto with = fly(flown, off, std::make_shared<SimulatedViews>(flown, 0.5));
  for (size_t i = 0; i < with.size(); ++i) {
    ASSERT_EQ(with[i].state.T_WB.matrix(), without[i].state.T_WB.matrix()) << i;
    ASSERT_EQ(with[i].covariance, without[i].covariance) << i;
    ASSERT_TRUE(with[i].recalled.empty());
  }
}

TEST(OdometryWithMap, RepeatsItselfToTheBitAndKeepsNoMoreViewsThanItMay) {
  const SimulatedFlight flown = flight(2, 10.0);
  MapOptions map;
  map.max_keyframes = 5;
  const auto views = std::make_shared<SimulatedViews>(flown, 0.5);
  const auto one = fly(flown, map, views);
  const auto two = fly(flown, map, std::make_shared<SimulatedViews>(flown, 0.5));
  for (size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].state.T_WB.matrix(), two[i].state.T_WB.matrix()) << i;
    ASSERT_EQ(one[i].covariance, two[i].covariance) << i;
  }
  const FixedLagOptions options;
  EXPECT_LE(views->views(),
            static_cast<size_t>(map.max_keyframes + options.keyframes + options.recent_frames));
}

TEST(OdometryWithMap, AReturningFlightDriftsLessAndKnowsByHowMuch) {
  // Three flights: position and rotation are nearly the same number for a whole flight, so that the
  // mean NEES is known to a half; odometry_consistency flies more.
  double with = 0.0, without = 0.0;
  Vector5d nees = Vector5d::Zero();
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SimulatedFlight flown = flight(seed);
    const auto outputs = fly(flown, {}, std::make_shared<SimulatedViews>(flown, 0.525));
    EXPECT_GT(foundAgain(outputs), 100) << seed;
    with += std::pow(lateError(outputs, flown, 10.0), 2);
    without += std::pow(lateError(fly(flown, {}, nullptr), flown, 10.0), 2);
    for (size_t i = 100; i < outputs.size(); ++i, ++count)
      nees += neesOf(outputs[i], flown.truth[i]);
  }
  nees /= count;
  RecordProperty("nees", (std::ostringstream() << nees.transpose()).str());
  RecordProperty("errors", (std::ostringstream() << with << ' ' << without).str());
  EXPECT_LT(with, 0.7 * without);
  for (int b = 0; b < 5; ++b) {
    EXPECT_GT(nees[b], 0.4) << nees.transpose();
    EXPECT_LT(nees[b], 2.0) << nees.transpose();
  }
}

TEST(OdometryWithMap, WhatIsFoundWronglyIsLeftOut) {
  // A third of a view's landmarks are found up to 8 px from where they are.
  double with = 0.0, wrong = 0.0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const SimulatedFlight flown = flight(seed, 20.0);
    with += lateError(fly(flown, {}, std::make_shared<SimulatedViews>(flown, 0.525)), flown, 10.0);
    const auto outputs = fly(flown, {}, std::make_shared<SimulatedViews>(flown, 0.525, 0.33));
    EXPECT_GT(foundAgain(outputs), 50) << seed;
    wrong += lateError(outputs, flown, 10.0);
  }
  EXPECT_LT(wrong, 1.5 * with);
}

TEST(OdometryWithMap, AWorldThatMovesChangesNothingElse) {
  const SimulatedFlight flown = flight(4, 12.0);
  const SE3 T(expSO3({0.0, 0.0, 0.7}), {3.0, -2.0, 1.0});
  FixedLagOdometry stays(flown.calibration, mapOptionsFor(flown)),
      moves(flown.calibration, mapOptionsFor(flown));
  const OdometryStart start = flown.startAt(0, startSigma(), 7);
  stays.start(start, flown.frames[0]);
  moves.start(start, flown.frames[0]);
  for (size_t i = 1; i < flown.frames.size(); ++i) {
    const OdometryOutput a = stays.process(flown.frames[i], flown.between(i - 1, i));
    const OdometryOutput b = moves.process(flown.frames[i], flown.between(i - 1, i));
    if (i == 60) {
      ASSERT_TRUE(moves.moveWorld(T));
    }
    if (i <= 60) continue;
    const Eigen::Matrix<double, 15, 1> d = b.state.minus(a.state.moved(T));
    ASSERT_LT(d.cwiseAbs().maxCoeff(), 1e-6) << "frame " << i << ": " << d.transpose();
    const auto turn = errorsTurned(T.R);
    const Matrix15d expected = turn * a.covariance * turn.transpose();
    ASSERT_LT((b.covariance - expected).norm(), 1e-5 * expected.norm());
    ASSERT_EQ(a.keyframe, b.keyframe);
  }
}

}  // namespace
}  // namespace etalon
