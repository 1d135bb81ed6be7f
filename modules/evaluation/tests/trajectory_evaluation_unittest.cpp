#include "etalon/evaluation/trajectory_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr TimeNs kMs = 1'000'000;

/** Poses along x, one a stamp [ms]. */
Trajectory along(const std::vector<int>& stamps_ms) {
  Trajectory trajectory;
  for (const int ms : stamps_ms)
    trajectory.push_back({ms * kMs, SE3(Eigen::Matrix3d::Identity(), Vector3d(ms, 0, 0))});
  return trajectory;
}

std::vector<std::pair<int, int>> pairsOf(const AssociatedTrajectories& a) {
  std::vector<std::pair<int, int>> pairs;
  EXPECT_EQ(a.estimate.size(), a.reference.size());
  for (size_t i = 0; i < a.estimate.size(); ++i)
    pairs.emplace_back(a.estimate[i].t / kMs, a.reference[i].t / kMs);
  return pairs;
}

using Pairs = std::vector<std::pair<int, int>>;

TEST(Association, TakesTheNearestStampWithinTheLimit) {
  const Trajectory reference = along({0, 5, 10, 15, 20, 25, 100});
  EXPECT_EQ(pairsOf(associate(along({1, 9, 13, 40, 110}), reference)),
            (Pairs{{1, 0}, {9, 10}, {13, 15}, {110, 100}}));
  EXPECT_EQ(pairsOf(associate(along({1, 9, 111}), reference, 0.002)), (Pairs{{1, 0}, {9, 10}}));
}

TEST(Association, GoesFromTheShorterTrajectory) {
  // A dense estimate: every pose of the reference gets one.
  EXPECT_EQ(pairsOf(associate(along({0, 5, 10, 15, 20, 25}), along({4, 21}))),
            (Pairs{{5, 4}, {20, 21}}));
}

TEST(Association, UsesEveryPoseOnce) {
  EXPECT_EQ(pairsOf(associate(along({8, 11}), along({10, 50, 60}))), (Pairs{{11, 10}}));
  EXPECT_EQ(pairsOf(associate(along({9, 12}), along({10, 50, 60}))), (Pairs{{9, 10}}));
}

TEST(Association, OfNothingIsNothing) {
  EXPECT_TRUE(associate({}, along({1})).estimate.empty());
  EXPECT_TRUE(associate(along({1}), Trajectory()).estimate.empty());
  EXPECT_TRUE(associate(along({1}), along({20})).estimate.empty());
  EXPECT_EQ(absoluteErrors({}, AlignmentType::kSE3).position_m.count, 0u);
  EXPECT_EQ(relativeErrors({}, {}).position_m.count, 0u);
}

/** A reference along x in steps of 0.4 m; the estimate is off by 0.1 m in y at its third pose, and
 * its world is moved. */
AssociatedTrajectories bent() {
  AssociatedTrajectories pair;
  for (int k = 0; k < 7; ++k) {
    SE3 T(Eigen::Matrix3d::Identity(), Vector3d(0.4 * k, 0, 0));
    pair.reference.push_back({k * 50 * kMs, T});
    if (k == 2) T.t.y() += 0.1;
    pair.estimate.push_back({k * 50 * kMs, T});
  }
  return pair;
}

TEST(AbsoluteErrors, WithAndWithoutAlignment) {
  AssociatedTrajectories pair = bent();
  const ErrorStatistics raw = absoluteErrors(pair, std::nullopt).position_m;
  EXPECT_EQ(raw.count, 7u);
  EXPECT_NEAR(raw.max, 0.1, 1e-15);
  EXPECT_NEAR(raw.sse, 0.01, 1e-15);
  const SE3 T_WG(expSO3(Vector3d(0.1, 0.2, 2.0)), Vector3d(1, 2, 3));
  AssociatedTrajectories moved = pair;
  for (StampedPose& pose : moved.estimate) pose.T_WB = T_WG * pose.T_WB;
  EXPECT_NEAR(absoluteErrors(moved, AlignmentType::kSE3).position_m.rmse,
              absoluteErrors(pair, AlignmentType::kSE3).position_m.rmse, 1e-14);
  EXPECT_GT(absoluteErrors(moved, std::nullopt).position_m.rmse, 1.0);
  EXPECT_GT(absoluteErrors(moved, std::nullopt).rotation_deg.min, 100.0);
}

TEST(RelativeErrors, OverMetresOfTheEstimatesPath) {
  // Steps of 0.4, sqrt(0.17), sqrt(0.17), 0.4 ... m: 1 m is passed at poses 3 and 6.
  const ErrorStatistics metre = relativeErrors(bent(), {1.0, DeltaUnit::kMeters}).position_m;
  EXPECT_EQ(metre.count, 1u);
  EXPECT_NEAR(metre.max, 0.0, 1e-15);
  // 0.8 m at 2 (0.812), 4 (0.812), 6: of 2 -> 4 the estimate's start is 0.1 m off.
  const ErrorStatistics less = relativeErrors(bent(), {0.8, DeltaUnit::kMeters}).position_m;
  EXPECT_EQ(less.count, 2u);
  EXPECT_NEAR(less.max, 0.1, 1e-15);
}

TEST(RelativeErrors, RefuseALengthThatCannotBe) {
  for (const double length : {0.0, -1.0, 1.5, 1e300})
    EXPECT_THROW(relativeErrors(bent(), {length, DeltaUnit::kFrames}), ConfigError) << length;
  EXPECT_THROW(relativeErrors(bent(), {0.0, DeltaUnit::kMeters}), ConfigError);
  EXPECT_EQ(deltaUnitFromName("meters"), DeltaUnit::kMeters);
  EXPECT_THROW(deltaUnitFromName("miles"), ConfigError);
}

/** Four states, 0.25 s apart, on the corners of a squareFlight of 1 m, level. */
GroundTruth squareFlight() {
  GroundTruth truth;
  truth.states.resize(4);
  const Vector3d corners[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  for (size_t k = 0; k < 4; ++k) {
    truth.states[k].t = 250 * kMs * static_cast<TimeNs>(k);
    truth.states[k].T_WB.t = corners[k];
  }
  return truth;
}

TEST(TrajectoryMetrics, AbsoluteErrorsByHand) {
  // A squareFlight; the estimate 1.1 times as large and turned about z: each corner 0.1 / sqrt(2) off, no
  // rotation error.
  const GroundTruth truth = squareFlight();
  const SE3 T_WG(expSO3(Vector3d(0, 0, 0.7)), Vector3d(1, 2, 3));
  Trajectory estimate;
  for (const StampedState& s : truth.states)
    estimate.push_back({s.t, T_WG * SE3(s.T_WB.R, 1.1 * s.T_WB.t)});
  estimate.push_back({5'000'000'000, SE3()});  // without ground truth
  for (const AlignmentType type : {AlignmentType::kSE3, AlignmentType::kYawPosition}) {
    const TrajectoryErrors e = absoluteErrors(associate(estimate, truth), type);
    EXPECT_EQ(e.position_m.count, 4u);
    EXPECT_NEAR(e.position_m.rmse, 0.1 / std::sqrt(2.0), 1e-14);
    EXPECT_NEAR(e.position_m.max, 0.1 / std::sqrt(2.0), 1e-14);
    EXPECT_LT(e.rotation_deg.max, 1e-12);
  }
  EXPECT_LT(absoluteErrors(associate(estimate, truth), AlignmentType::kSim3).position_m.max, 1e-14);
  EXPECT_EQ(
      absoluteErrors(associate(estimate, GroundTruth()), AlignmentType::kSE3).position_m.count, 0u);
}

TEST(TrajectoryMetrics, RelativeErrorsByHand) {
  const GroundTruth truth = squareFlight();
  Trajectory estimate;
  for (const StampedState& s : truth.states) estimate.push_back({s.t, s.T_WB});
  estimate[3].T_WB.t.z() += 0.5;  // only the step 2 -> 3 is off
  estimate[3].T_WB.R = expSO3(Vector3d(0, 0, 2 * M_PI / 180.0));
  const TrajectoryErrors one = relativeErrors(associate(estimate, truth), {1, DeltaUnit::kFrames});
  EXPECT_EQ(one.position_m.count, 3u);
  EXPECT_NEAR(one.position_m.max, 0.5, 1e-15);
  EXPECT_NEAR(one.position_m.rmse, 0.5 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(one.rotation_deg.max, 2.0, 1e-12);
  const TrajectoryErrors two = relativeErrors(associate(estimate, truth), {2, DeltaUnit::kFrames});
  EXPECT_EQ(two.position_m.count, 1u);  // 0 -> 2; 2 -> 4 does not exist
  EXPECT_EQ(two.position_m.max, 0.0);
  EXPECT_EQ(relativeErrors(associate(estimate, truth), {4, DeltaUnit::kFrames}).position_m.count,
            0u);
}

}  // namespace
}  // namespace etalon
