#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/odometry/visual_solution.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** Rotation of the body between two keyframes of a window, truth. */
Eigen::Matrix3d relativeRotation(const SyntheticWindow& window, size_t k) {
  return window.truth[k - 1].T_WB.R.transpose() * window.truth[k].T_WB.R;
}

TEST(StereoOdometry, FollowsExactTracks) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  StereoOdometry odometry(window.calibration, {});
  const std::vector<const TrackedFrame*> keyframes = window.keyframes();
  for (size_t k = 0; k < keyframes.size(); ++k) {
    const auto result = odometry.track(
        *keyframes[k], k ? relativeRotation(window, k) : Eigen::Matrix3d::Identity(), true);
    ASSERT_TRUE(result.located);
    const SE3 truth = window.truth[0].T_WB.inverse() * window.truth[k].T_WB;
    // Exact tracks; five Levenberg-Marquardt iterations a keyframe stop short of rounding.
    EXPECT_LT((result.T_VB.t - truth.t).norm(), 1e-5);
    EXPECT_LT(logSO3(result.T_VB.R.transpose() * truth.R).norm(), 1e-5);
  }
  const SE3 T_VW = window.truth[0].T_WB.inverse();
  EXPECT_LT((odometry.bundleAdjust({}).T_VB[3].t - (T_VW * window.truth[3].T_WB).t).norm(), 1e-5);
}

TEST(StereoOdometry, PredictsAndSaysSoWhereNothingIsSeen) {
  const SyntheticWindow window = testing::makeSyntheticWindow({});
  StereoOdometry odometry(window.calibration, {});
  odometry.track(window.frames[0], Eigen::Matrix3d::Identity(), true);
  odometry.track(window.frames[1], Eigen::Matrix3d::Identity(), false);
  TrackedFrame empty;
  empty.t = window.frames[2].t;
  const Eigen::Matrix3d turn = expSO3(Eigen::Vector3d(0, 0, 0.1));
  const SE3 before = odometry.pose();
  const auto result = odometry.track(empty, turn, false);
  EXPECT_FALSE(result.located);
  EXPECT_LT(logSO3((before.R * turn).transpose() * result.T_VB.R).norm(), 1e-12);
  // And it goes on when there is something to see again.
  odometry.track(window.frames[3], Eigen::Matrix3d::Identity(), true);
  EXPECT_TRUE(odometry.track(window.frames[4], Eigen::Matrix3d::Identity(), false).located);
}

TEST(SolveStereoOdometry, ReturnsPosesLandmarksAndCovariance) {
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<Eigen::Matrix3d> rotations;
  for (size_t k = 1; k < window.truth.size(); ++k) rotations.push_back(relativeRotation(window, k));
  StereoOdometryOptions odometry;
  odometry.sigma_px = 0.5;
  const VisualSolution solution =
      solveStereoOdometry(window.calibration, window.keyframes(), rotations, odometry).value();
  ASSERT_EQ(solution.T_VB.size(), window.truth.size());
  EXPECT_GT(solution.landmarks.size(), 200U);
  EXPECT_EQ(solution.covariance.rows(), 6 * 9);
  EXPECT_NEAR(solution.rms_px, 0.45, 0.05);  // 0.5 px less the freedom of the landmarks
  const SE3 last = window.truth[0].T_WB.inverse() * window.truth.back().T_WB;
  // Within five standard deviations of its own covariance.
  const Eigen::Vector3d sigma = solution.covariance.diagonal().tail<3>().cwiseSqrt();
  const Eigen::Vector3d error = solution.T_VB.back().t - last.t;
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(error[i]), 5.0 * sigma[i]);
}

TEST(SolveStereoOdometry, SaysWhereItLostItsWay) {
  SyntheticWindow window = testing::makeSyntheticWindow({});
  std::vector<const TrackedFrame*> keyframes = window.keyframes();
  TrackedFrame blind;
  blind.t = keyframes[4]->t;
  keyframes[4] = &blind;
  const Expected<VisualSolution> solution =
      solveStereoOdometry(window.calibration, keyframes,
                          std::vector<Eigen::Matrix3d>(9, Eigen::Matrix3d::Identity()), {});
  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().status, RefusalStatus::kTooFewTracks);
  EXPECT_EQ(solution.error().value, 0.0);  // measurements that agree
  EXPECT_EQ(solution.error().bound, StereoOdometryOptions().min_pose_inliers);
  EXPECT_NE(solution.error().reason.find("keyframe 4"), std::string::npos);
}

}  // namespace
}  // namespace etalon
