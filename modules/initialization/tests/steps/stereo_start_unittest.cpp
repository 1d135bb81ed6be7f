#include "etalon/initialization/steps/stereo_start.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::Motion;
using testing::SyntheticWindowOptions;

constexpr double kMaxChi2 = 16.0;

struct Case {
  explicit Case(const SyntheticWindowOptions& options)
      : synthetic(testing::makeSyntheticWindow(options)),
        window(buildVisualWindow(synthetic.calibration, synthetic.keyframes(), 0.5)),
        points(stereoPoints(window, kMaxChi2)) {
    for (size_t k = 1; k < synthetic.truth.size(); ++k)
      preintegrations.emplace_back(
          synthetic.imu.between(synthetic.truth[k - 1].t, synthetic.truth[k].t), ImuBias(),
          synthetic.calibration.imu.noise);
  }
  double baseline() const { return synthetic.calibration.baseline(); }

  testing::SyntheticWindow synthetic;
  VisualWindow window;
  StereoPoints points;
  std::vector<Preintegration> preintegrations;  ///< without a bias
};

SyntheticWindowOptions aggressive() {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  return options;
}

TEST(MedianOf, IsTakenPerAxis) {
  EXPECT_EQ(medianOf({{1, 2, 3}}), Vector3d(1, 2, 3));
  EXPECT_EQ(medianOf({{1, 50, 3}, {2, 2, -9}, {90, 1, 4}}), Vector3d(2, 2, 3));
}

TEST(StereoPoints, AreTheLandmarksInTheBodyFrameOfEachKeyframe) {
  const Case c(aggressive());
  size_t count = 0;
  for (size_t l = 0; l < c.points.of_landmark.size(); ++l)
    for (const StereoPoints::Point& point : c.points.of_landmark[l]) {
      const SE3& T_WB = c.synthetic.truth[point.keyframe].T_WB;
      const size_t id = c.window.landmark_ids[l];
      const Vector3d truth = T_WB.inverse() * c.synthetic.landmarks[id];
      EXPECT_LT((point.p_B - truth).norm(), 1e-6 * truth.squaredNorm());
      ++count;
    }
  EXPECT_GT(count, 10U * 100U);
}

TEST(StereoPoints, RaysThatMissEachOtherGiveNoPoint) {
  SyntheticWindowOptions options = aggressive();
  options.outlier_share = 0.3;
  const Case c(options);
  const StereoPoints all = stereoPoints(c.window, 1e12);
  size_t kept = 0, possible = 0;
  double worst_kept = 0.0;
  for (size_t l = 0; l < all.of_landmark.size(); ++l) {
    kept += c.points.of_landmark[l].size();
    possible += all.of_landmark[l].size();
    for (const StereoPoints::Point& point : c.points.of_landmark[l]) {
      const SE3& T_WB = c.synthetic.truth[point.keyframe].T_WB;
      const size_t id = c.window.landmark_ids[l];
      const Vector3d p_B = T_WB.inverse() * c.synthetic.landmarks[id];
      // Across the ray: an outlier along the epipolar line may pass.
      worst_kept = std::max(worst_kept, angleBetween(point.p_B, p_B));
    }
  }
  EXPECT_LT(kept, possible);
  EXPECT_GT(kept, possible / 3);
  EXPECT_LT(worst_kept, 0.2);
}

TEST(GyroBiasOfPoints, IsTheBiasUpToItsSquareOnExactPoints) {
  for (const Motion motion :
       {Motion::kGentle, Motion::kAggressive, Motion::kPureRotation, Motion::kStandstill}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias.gyro = {0.02, -0.06, 0.04};
    const Case c(options);
    const Vector3d once = gyroBiasOfPoints(c.points, c.preintegrations, c.baseline(), 10.0);
    // Linear in the bias: off by about |b_g|^2 dt.
    EXPECT_LT((once - options.bias.gyro).norm(), 2e-3);
    std::vector<Preintegration> again;
    for (const Preintegration& p : c.preintegrations)
      again.push_back(p.reintegrated({once, Vector3d::Zero()}));
    EXPECT_LT((gyroBiasOfPoints(c.points, again, c.baseline(), 10.0) - options.bias.gyro).norm(),
              2e-5);
  }
}

TEST(GyroBiasOfPoints, OutliersHaveABoundedPull) {
  SyntheticWindowOptions options = aggressive();
  options.bias.gyro = {0.02, -0.06, 0.04};
  options.outlier_share = 0.15;
  const Case c(options);
  const Vector3d b_g = gyroBiasOfPoints(c.points, c.preintegrations, c.baseline(), 10.0);
  EXPECT_LT((b_g - options.bias.gyro).norm(), 0.01);
}

TEST(GyroBiasOfPoints, ThePriorHoldsWhatThePointsDoNotSay) {
  SyntheticWindowOptions options = aggressive();
  options.bias.gyro = {0.02, -0.06, 0.04};
  const Case c(options);
  const Vector3d held = gyroBiasOfPoints(c.points, c.preintegrations, c.baseline(), 1e-9);
  EXPECT_LT(held.norm(), 1e-4);  // around the preintegrations' own, which is zero
  EXPECT_EQ(gyroBiasOfPoints({}, c.preintegrations, c.baseline(), 1.0), Vector3d::Zero());
}

TEST(MedianPositions, FollowTheTruthUnderTrueRotations) {
  for (const double outlier_share : {0.0, 0.15}) {
    SyntheticWindowOptions options = aggressive();
    options.outlier_share = outlier_share;
    const Case c(options);
    const SE3 T_VW = c.synthetic.truth[0].T_WB.inverse();
    std::vector<Matrix3d> rotations;
    for (const StampedState& s : c.synthetic.truth) rotations.push_back(T_VW.R * s.T_WB.R);
    const std::vector<SE3> T_VB = medianPositions(c.points, rotations);
    ASSERT_EQ(T_VB.size(), rotations.size());
    EXPECT_EQ(T_VB[0].t, Vector3d::Zero());
    for (size_t k = 0; k < T_VB.size(); ++k) {
      EXPECT_EQ(T_VB[k].R, rotations[k]);
      // Exact without outliers; with them the median of each step moves by millimetres.
      EXPECT_LT((T_VB[k].t - T_VW * c.synthetic.truth[k].T_WB.t).norm(),
                outlier_share == 0.0 ? 1e-5 : 0.05);
    }
  }
}

TEST(MedianPositions, AStepWithoutCommonLandmarksIsAsTheOneBefore) {
  StereoPoints points;
  // Seen in keyframes 0 and 1 alone, which are 1 m apart; keyframe 2 shares nothing.
  points.of_landmark = {{{0, {5, 0, 0}}, {1, {4, 0, 0}}}, {{0, {3, 1, 0}}, {1, {2, 1, 0}}}};
  const std::vector<SE3> T_VB =
      medianPositions(points, std::vector<Matrix3d>(3, Matrix3d::Identity()));
  EXPECT_EQ(T_VB[1].t, Vector3d(1, 0, 0));
  EXPECT_EQ(T_VB[2].t, Vector3d(2, 0, 0));
}

}  // namespace
}  // namespace etalon
