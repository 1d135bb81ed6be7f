#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/initialization/steps/normal_epipolar_step.h"
#include "etalon/initialization/steps/translation_step.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

SyntheticWindowOptions biased() {
  SyntheticWindowOptions options;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  return options;
}

TEST(GyroBiasFromRotations, IsTheBiasOfTrueRotationsUpToSecondOrder) {
  const SyntheticWindowOptions options = biased();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  std::vector<Matrix3d> rotations;
  for (const StampedState& state : window.truth) rotations.push_back(state.T_WB.R);
  // One step from zero: off by about |b_g|^2 dt = 1.4e-3; a second from there: by the square.
  const Vector3d once = gyroBiasFromRotations(rotations, problem.preintegrate(ImuBias()));
  EXPECT_LT((once - options.bias.gyro).norm(), 1.5e-3);
  const Vector3d twice =
      gyroBiasFromRotations(rotations, problem.preintegrate({once, Vector3d::Zero()}));
  EXPECT_LT((twice - options.bias.gyro).norm(), 1e-6);
}

TEST(IntegrateRotations, FollowsTheTruthWithTheTrueBias) {
  const SyntheticWindowOptions options = biased();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  const std::vector<Matrix3d> rotations =
      integrateRotations(window.truth[0].T_WB.R, problem.preintegrate(options.bias), options.bias);
  ASSERT_EQ(rotations.size(), window.truth.size());
  for (size_t k = 0; k < rotations.size(); ++k)
    EXPECT_LT((rotations[k] - window.truth[k].T_WB.R).norm(), 1e-10);
}

TEST(InertialOnlyStep, TakesAGyroBiasFoundElsewhereAsStartOrAsMeasurement) {
  const SyntheticWindowOptions options = biased();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  InertialOnlyStepOptions map;
  const Vector3d alone = solveInertialOnlyStep(problem, map)->map.bias.gyro;
  GyroBiasMeasurement found;
  found.gyro = options.bias.gyro + Vector3d(0.01, 0.0, -0.01);
  // A start alone does not change where the MAP ends.
  EXPECT_LT((solveInertialOnlyStep(problem, map, found)->map.bias.gyro - alone).norm(), 1e-6);
  // A certain measurement is kept.
  found.information = 1e14 * Matrix3d::Identity();
  EXPECT_LT((solveInertialOnlyStep(problem, map, found)->map.bias.gyro - found.gyro).norm(), 1e-6);
}

TEST(NormalEpipolarStep, NamesTheReasonOfEveryRefusal) {
  const SyntheticWindowOptions options = biased();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  const std::vector<Preintegration> preintegrations = problem.preintegrate(ImuBias());
  const auto refusal = [&](const NormalEpipolarStepOptions& o) {
    const auto step = solveNormalEpipolarStep(problem, preintegrations, Vector3d::Zero(), o);
    EXPECT_FALSE(step.error().reason.empty());
    return step.error().status;
  };
  NormalEpipolarStepOptions few;
  few.solver.min_matches = 10000;
  EXPECT_EQ(refusal(few), RefusalStatus::kTooFewTracks);
  NormalEpipolarStepOptions certain;
  certain.max_sigma_gyro_rps = 1e-9;
  EXPECT_EQ(refusal(certain), RefusalStatus::kIllConditioned);
  NormalEpipolarStepOptions small;
  small.max_gyro_bias_rps = 0.05;  // the true one is 0.075
  EXPECT_EQ(refusal(small), RefusalStatus::kImplausible);
}

TEST(InertialOnlyStep, SaysWhyItFailed) {
  const SyntheticWindowOptions options = biased();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  InitializationProblem::Data data = makeProblem(window, options).data();
  data.gravity_mps2 = std::numeric_limits<double>::quiet_NaN();
  const auto step = solveInertialOnlyStep(InitializationProblem(data), InertialOnlyStepOptions());
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().status, RefusalStatus::kNotConverged);
  EXPECT_EQ(step.error().reason,
            "the inertial-only MAP failed after 0 iterations: the cost is not finite");
  InertialOnlyStepOptions hasty;
  hasty.max_iterations = 1;
  const auto stopped = solveInertialOnlyStep(makeProblem(window, options), hasty);
  ASSERT_FALSE(stopped);
  EXPECT_NE(stopped.error().reason.find("did not converge in 1 iterations"), std::string::npos)
      << stopped.error().reason;
}

TEST(TranslationStep, SaysThatTheTranslationsAreNotDetermined) {
  SyntheticWindowOptions options = biased();
  options.sigma_px = 0.5;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  TranslationStepOptions step;
  step.ba.chi2_threshold = 1e-12;  // after the first round nothing is left
  const auto result = solveTranslationStep(problem, problem.preintegrate(options.bias),
                                           options.bias, Vector3d(0, 0, -9.81), step, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().status, RefusalStatus::kIllConditioned);
  EXPECT_NE(result.error().reason.find("the landmarks do not determine the translations"),
            std::string::npos)
      << result.error().reason;
}

}  // namespace
}  // namespace etalon
