#include "rotation_filter.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon::plugins {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

Vector3d errorOf(const Matrix3d& R, const Matrix3d& truth) { return logSO3(truth.transpose() * R); }

/** Errors of the last attitude and of b_g over drawn windows, against their maps. */
TEST(RotationFilter, ErrsAsItSays) {
  double nees_rotation = 0.0, nees_bias = 0.0;
  constexpr int kRuns = 40;
  int runs = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const SyntheticWindowOptions options =
        testing::drawnOptions(testing::Motion::kGentle, seed, 0.5);
    const SyntheticWindow window = testing::withoutBiasWalk(options);
    const InitializationProblem problem = testing::makeProblem(window, options);
    const auto& visual = problem.visualSolution();
    if (!visual) continue;
    ++runs;
    const FilteredRotations result = filterRotations(problem, *visual, 5, 0.0);
    const SE3 T_VW = visual->T_VB[0] * window.truth[0].T_WB.inverse();
    const ErrorSources& sources = result.estimate.errors->sources;
    const size_t last = window.truth.size() - 1;
    const Matrix3d truth = (T_VW * window.truth[last].T_WB).R;
    const Vector3d rotation = errorOf(result.estimate.T_VB[last].R, truth);
    const Vector3d bias = result.estimate.bias.gyro - options.bias.gyro;
    const Eigen::MatrixXd of_rotation = result.estimate.errors->poses.middleRows<3>(6 * (last - 1));
    const Eigen::MatrixXd of_bias = result.estimate.errors->map.topRows<3>();
    nees_rotation += squaredMahalanobis(rotation, sources.covarianceOf(of_rotation));
    nees_bias += squaredMahalanobis(bias, sources.covarianceOf(of_bias));
  }
  ASSERT_GE(runs, 35);
  // Mean of chi-square with three degrees of freedom, three standard deviations.
  EXPECT_NEAR(nees_rotation / runs, 3.0, 3.0 * std::sqrt(6.0 / runs));
  EXPECT_NEAR(nees_bias / runs, 3.0, 3.0 * std::sqrt(6.0 / runs));
}

TEST(RotationFilter, IsSecondOrderInTheBiasAfterOnePass) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.bias.gyro = {0.1, -0.1, 0.1};
  options.priors.sigma_gyro_rps = 1e3;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  const auto& visual = problem.visualSolution();
  ASSERT_TRUE(visual);
  const auto error = [&](int passes) {
    return (filterRotations(problem, *visual, passes, 0.0).estimate.bias.gyro - options.bias.gyro)
        .norm();
  };
  EXPECT_GT(error(1), 1e-5);
  EXPECT_LT(error(1), 0.05 * options.bias.gyro.norm());
  EXPECT_LT(error(8), 1e-7);
}

}  // namespace
}  // namespace etalon::plugins
