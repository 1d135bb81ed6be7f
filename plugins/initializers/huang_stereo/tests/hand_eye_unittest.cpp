#include "hand_eye.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <utility>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon::plugins {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** Errors of b_g and R_BC over drawn windows, against their maps. */
TEST(HandEye, ErrsAsItSays) {
  double bias_nees = 0.0, rotation_nees = 0.0;
  int runs = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const SyntheticWindowOptions options =
        testing::drawnOptions(testing::Motion::kAggressive, seed, 0.3);
    const SyntheticWindow window = testing::withoutBiasWalk(options);
    const InitializationProblem problem = testing::makeProblem(window, options);
    const auto& visual = problem.visualSolution();
    if (!visual) continue;
    const auto result = solveHandEye(problem, *visual, true, 20);
    ASSERT_TRUE(result);
    ++runs;
    const ErrorSources& sources = result->errors->sources;
    const Vector3d bias = result->bias.gyro - options.bias.gyro;
    const Vector3d rotation =
        logSO3(result->R_BC * window.calibration.cameras[0].T_BC.R.transpose());
    const MatrixXd of_bias = sources.covarianceOf(result->errors->map.topRows<3>());
    const MatrixXd of_rotation = sources.covarianceOf(result->rotation_errors);
    bias_nees += squaredMahalanobis(bias, of_bias);
    rotation_nees += squaredMahalanobis(rotation, of_rotation);
  }
  ASSERT_GE(runs, 35);
  // Mean of chi-square with three degrees of freedom, three standard deviations.
  EXPECT_NEAR(bias_nees / runs, 3.0, 3.0 * std::sqrt(6.0 / runs));
  EXPECT_NEAR(rotation_nees / runs, 3.0, 3.0 * std::sqrt(6.0 / runs));
}

TEST(HandEye, NeedsRotationAboutTwoAxes) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  ASSERT_TRUE(problem.visualSolution());
  const auto result = solveHandEye(problem, *problem.visualSolution(), false, 10);
  // The noise of the attitudes is rotation enough for a solution, which says that it knows nothing.
  ASSERT_TRUE(result);
  EXPECT_GT(result->sigma_rotation, 0.1);  // rad
}

/** Ten keyframes in 2.25 s of a body that turns at these rates (rad/s, by seconds), the same in the
 * gyro and, with an error of its own in every step, in the attitudes of stereo odometry. */
struct Turning {
  InitializationProblem problem;
  VisualSolution visual;
};

Turning turning(const std::function<Vector3d(double)>& rate, double sigma_rad, unsigned seed) {
  InitializationProblem::Data data;
  data.calibration = eurocCalibration();
  data.imu_noise = data.calibration.imu.noise;
  for (int i = 0; i <= 450; ++i) {
    ImuSample sample;
    sample.t = durationNs(0.005 * i);
    sample.gyro = rate(0.005 * i);
    sample.accel = {0.0, 0.0, data.gravity_mps2};
    data.imu.add(sample);
  }
  for (int k = 0; k < 10; ++k) {
    TrackedFrame frame;
    frame.t = durationNs(0.25 * k);
    data.frames.push_back(frame);
    data.keyframe_indices.push_back(k);
  }
  const InitializationProblem problem(std::move(data));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, sigma_rad);
  VisualSolution visual;
  visual.T_VB.emplace_back();
  for (const Preintegration& step : problem.preintegrate(ImuBias())) {
    const Vector3d error(normal(random), normal(random), normal(random));
    const Matrix3d R_VB = visual.T_VB.back().R * step.deltas().dR * expSO3(error);
    visual.T_VB.emplace_back(R_VB, Vector3d::Zero());
  }
  return {problem, visual};
}

/** The rotation of the cameras about that axis is any; without noise nothing but the rank says so. */
TEST(HandEye, IsNotDeterminedByTurnsAboutOneAxisHoweverExactTheyAre) {
  for (const Vector3d& axis : {Vector3d(0.6, 0.0, 0.8), Vector3d(0.36, 0.48, 0.8),
                               Vector3d(1.0, 0.0, 0.0), Vector3d(0.0, 0.0, 1.0)}) {
    const Turning one = turning([&](double t) { return (0.5 + std::sin(3.0 * t)) * axis; }, 0.0, 1);
    EXPECT_FALSE(solveHandEye(one.problem, one.visual, false, 10)) << axis.transpose();
  }
}

/** The body turns about an axis that is none of its own, and a little about the others: about that
 * axis the rotation is known worst by far. */
TEST(HandEye, ItsSigmaIsThatOfTheWeakestAxisWhicheverThatIs) {
  const Vector3d axis = Vector3d(1.0, 1.0, 1.0) / std::sqrt(3.0);
  const auto rate = [&axis](double t) -> Vector3d {
    return std::sin(3.0 * t) * axis +
           0.1 * Vector3d(std::sin(2.0 * t), std::cos(5.0 * t), std::sin(4.0 * t + 1.0));
  };
  const Matrix3d truth = eurocCalibration().cameras[0].T_BC.R;
  constexpr int kRuns = 60;
  double ratio = 0.0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Turning one = turning(rate, 1e-4, seed);
    const auto result = solveHandEye(one.problem, one.visual, false, 20);
    ASSERT_TRUE(result);
    const double error = axis.dot(logSO3(result->R_BC * truth.transpose()));
    ratio += std::pow(error / result->sigma_rotation, 2) / kRuns;
  }
  // 60 errors over sigmas of 21 degrees of freedom: 1.1 on average, known to a fifth.
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 1.7);
}

}  // namespace
}  // namespace etalon::plugins
