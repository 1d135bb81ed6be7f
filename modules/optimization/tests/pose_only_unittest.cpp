// The pose of one frame from known points: exact, robust, and honest where it cannot be had.

#include "etalon/optimization/bundle/pose_only.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSigmaPx = 0.5;

/** Points in front of a rig, and what its cameras see of them. */
struct Scene {
  StereoInertialCalibration rig = eurocCalibration();
  std::array<SE3, 2> T_CB;
  SE3 T_WB{expSO3({0.7, -1.1, 2.0}), {3.0, -2.0, 5.0}};
  std::vector<PointMeasurement> measurements;
  std::mt19937 random;

  explicit Scene(size_t points, double noise_px = 0.0, unsigned seed = 1) : random(seed) {
    for (size_t c = 0; c < 2; ++c) T_CB[c] = rig.cameras[c].T_BC.inverse();
    std::uniform_real_distribution<double> u(100.0, 650.0), v(80.0, 400.0), depth(2.0, 8.0);
    std::normal_distribution<double> normal;
    while (measurements.size() < 2 * points) {
      const Vector3d ray = *rig.cameras[0].model.unproject({u(random), v(random)});
      const Vector3d p_W = T_WB * (rig.cameras[0].T_BC * (depth(random) * ray));
      std::vector<PointMeasurement> both;
      for (int c = 0; c < 2; ++c) {
        const auto pixel =
            rig.cameras[c].model.project((T_WB * rig.cameras[c].T_BC).inverse() * p_W);
        const Vector2d noise = noise_px * Vector2d(normal(random), normal(random));
        if (const auto m = pixel ? makeMeasurement(rig.cameras[c].model, *pixel + noise, kSigmaPx)
                                 : std::nullopt)
          both.push_back({p_W, c, *m});
      }
      if (both.size() == 2) measurements.insert(measurements.end(), both.begin(), both.end());
    }
  }
  /** Moves what measurement `i` saw by so many sigmas of a pixel. */
  void spoil(size_t i, const Vector2d& sigmas) {
    ReprojectionMeasurement& m = measurements[i].measurement;
    m.xy += m.sqrt_information.inverse() * sigmas;
  }
  SE3 from(double rotation, double position) const {
    return {T_WB.R * expSO3(rotation * Vector3d(0.6, -0.64, 0.48)),
            T_WB.t + position * Vector3d(0.48, 0.6, -0.64)};
  }
  PoseOnlyResult solve(const SE3& guess, const PoseOnlyOptions& options = {}) const {
    return solvePoseOnly(T_CB, measurements, guess, options);
  }
  double error(const SE3& T) const {
    return (T.t - T_WB.t).norm() + logSO3(T_WB.R.transpose() * T.R).norm();
  }
};

TEST(PoseOnly, ExactMeasurementsGiveTheExactPoseFromAfar) {
  const Scene scene(40);
  for (const auto& [rotation, position] :
       {std::pair(0.0, 0.0), {0.02, 0.05}, {0.1, 0.3}, {0.3, 0.5}}) {
    const PoseOnlyResult result = scene.solve(scene.from(rotation, position));
    EXPECT_TRUE(result.summary.converged()) << rotation;
    EXPECT_LT(scene.error(result.T_WB), 1e-9) << rotation;
    EXPECT_EQ(result.inliers, 80);
    EXPECT_LT(result.summary.final_cost, 1e-12);
    EXPECT_LT((result.T_WB.R.transpose() * result.T_WB.R - Eigen::Matrix3d::Identity()).norm(),
              1e-12);
  }
}

TEST(PoseOnly, OneCameraIsEnough) {
  for (const int camera : {0, 1}) {
    Scene scene(40);
    std::vector<PointMeasurement> kept;
    for (const PointMeasurement& m : scene.measurements)
      if (m.camera == camera) kept.push_back(m);
    scene.measurements = kept;
    EXPECT_LT(scene.error(scene.solve(scene.from(0.05, 0.1)).T_WB), 1e-9) << camera;
  }
}

TEST(PoseOnly, WrongMeasurementsAreFoundAndLeftOut) {
  Scene scene(60);
  std::uniform_real_distribution<double> off(-80.0, 80.0);
  for (size_t i = 0; i < 120; i += 4) scene.spoil(i, {off(scene.random), 20.0 + off(scene.random)});
  const PoseOnlyResult result = scene.solve(scene.from(0.03, 0.1));
  EXPECT_TRUE(result.summary.usable());
  EXPECT_LT(scene.error(result.T_WB), 1e-9);
  for (size_t i = 0; i < 120; ++i) EXPECT_TRUE(i % 4 == 0 || result.inlier[i]) << i;
  EXPECT_LE(result.inliers, 90 + 2);
  EXPECT_EQ(result.inliers, std::count(result.inlier.begin(), result.inlier.end(), 1));
}

TEST(PoseOnly, TheThresholdIsOfTheSquaredWhitenedResidual) {
  // One of many measurements is off: the pose hardly follows it.
  for (const double sigmas : {2.9, 3.1}) {
    Scene scene(400);
    scene.spoil(100, {0.0, sigmas});
    PoseOnlyOptions options;
    options.chi2_threshold = 9.0;
    const PoseOnlyResult result = scene.solve(scene.T_WB, options);
    EXPECT_EQ(result.inlier[100], sigmas < 3.0);
    EXPECT_EQ(result.inliers, sigmas < 3.0 ? 800 : 799);
  }
}

TEST(PoseOnly, WithNoiseItErrsAsTheNormalEquationsSay) {
  // Mean squared error of 60 poses over the covariance that their Jacobians give, six degrees of
  // freedom each: known to a tenth. The inliers' cut at 95 % takes information away that the
  // covariance of all counts: some percent more.
  double sum = 0.0;
  constexpr int kPoses = 60;
  for (int run = 0; run < kPoses; ++run) {
    const Scene scene(40, kSigmaPx, static_cast<unsigned>(run + 1));
    const PoseOnlyResult result = scene.solve(scene.from(0.01, 0.02));
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    for (const PointMeasurement& m : scene.measurements) {
      Vector2d r;
      Eigen::Matrix<double, 2, 6> J;
      ASSERT_TRUE(
          reprojectionResidual(scene.T_CB[m.camera], m.measurement, scene.T_WB, m.p_W, &r, &J));
      H += J.transpose() * J;
    }
    Eigen::Matrix<double, 6, 1> e;
    e << logSO3(scene.T_WB.R.transpose() * result.T_WB.R), result.T_WB.t - scene.T_WB.t;
    sum += e.dot(H * e) / 6.0;
  }
  EXPECT_NEAR(sum / kPoses, 1.15, 0.3);
}

TEST(PoseOnly, SaysWhereThePointsDoNotDetermineIt) {
  Scene none(0);
  EXPECT_FALSE(none.solve(none.T_WB).summary.usable());
  Scene line(30);
  // All points are one point: three degrees of freedom at most.
  for (size_t i = 2; i < line.measurements.size(); ++i)
    line.measurements[i] = line.measurements[i % 2];
  const PoseOnlyResult singular = line.solve(line.from(0.01, 0.01));
  EXPECT_FALSE(singular.summary.usable());
  EXPECT_EQ(singular.summary.termination, Termination::kSingular);
}

TEST(PoseOnly, FewerThanSixThatAgreeAreNoPose) {
  // Five right ones among many that are all different.
  Scene scene(30);
  std::uniform_real_distribution<double> off(100.0, 400.0);
  for (size_t i = 5; i < 60; ++i)
    scene.spoil(i, {i % 2 ? off(scene.random) : -off(scene.random), off(scene.random)});
  PoseOnlyOptions options;
  options.rounds = 1;
  const PoseOnlyResult result = scene.solve(scene.T_WB, options);
  EXPECT_FALSE(result.summary.usable());
  EXPECT_LT(result.inliers, 6);
}

TEST(PoseOnly, PointsBehindTheCameraAreNoInliers) {
  Scene scene(40);
  for (size_t i = 0; i < 20; ++i)
    scene.measurements[i].p_W = scene.T_WB * Vector3d(scene.rig.cameras[0].T_BC.R.col(2) * -3.0);
  const PoseOnlyResult result = scene.solve(scene.from(0.02, 0.02));
  EXPECT_LT(scene.error(result.T_WB), 1e-9);
  EXPECT_EQ(result.inliers, 60);
  for (size_t i = 0; i < 20; ++i) EXPECT_FALSE(result.inlier[i]) << i;
}

}  // namespace
}  // namespace etalon
