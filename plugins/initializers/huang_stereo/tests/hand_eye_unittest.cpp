#include "hand_eye.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon::plugins {
namespace {

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
    bias_nees += bias.dot(of_bias.llt().solve(bias));
    rotation_nees += rotation.dot(of_rotation.llt().solve(rotation));
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
  EXPECT_TRUE(!result || !(result->sigma_rotation < 0.1));
}

}  // namespace
}  // namespace etalon::plugins
