#include "etalon/initialization/acceptance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/initialization/steps/visual_inertial_problem.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

/** Passes every gate. */
VisualInertialBaResult good() {
  VisualInertialBaResult result;
  result.summary.termination = Termination::kConverged;
  result.last_step_sigmas = 0.02;
  result.summary.iterations = 7;
  result.states.resize(2);
  result.measurements = 1000;
  result.inlier_measurements = 950;
  result.covariance = 1e-6 * Eigen::MatrixXd::Identity(24, 24);
  return result;
}

TEST(Acceptance, TakesWhatConvergedAndRefusesWhatDidNot) {
  EXPECT_TRUE(judge(good(), {}));
  VisualInertialBaResult stopped = good();
  stopped.summary.termination = Termination::kMaxIterations;
  stopped.last_step_sigmas = 0.87;
  stopped.summary.iterations = 100;
  const Expected<void> decision = judge(stopped, {});
  ASSERT_FALSE(decision);
  EXPECT_EQ(decision.error().status, RefusalStatus::kNotConverged);
  EXPECT_EQ(decision.error().value, 0.87);
  EXPECT_THAT(decision.error().reason, HasSubstr("last step was 0.87 standard deviations long"));
  EXPECT_THAT(decision.error().reason, HasSubstr("100 iterations"));
}

/** Sensor of `dof` degrees of freedom whose residuals are all alike in redundancy. */
void setSensor(VisualInertialBaResult* result, Eigen::Index sensor, double chi2, double dof,
               double square) {
  ResidualGroup* groups[] = {&result->noise.gyro, &result->noise.accel, &result->noise.vision};
  *groups[sensor] = {chi2, dof};
  result->noise.coupling(sensor, sensor) = square;
}

TEST(Acceptance, AFalseAlarmRateOfZeroLeavesTheChiSquareTestsOut) {
  VisualInertialBaResult result = good();
  setSensor(&result, 1, 1e6, 10.0, 10.0);
  result.accel_bias_sigmas = 40.0;
  EXPECT_FALSE(judge(result, {}));
  AcceptanceOptions options;
  options.false_alarm_rate = 0.0;
  EXPECT_TRUE(judge(result, options));
}

TEST(Acceptance, RefusesASensorByItsOwnChiSquareAtTheFalseAlarmRate) {
  AcceptanceOptions options;
  options.false_alarm_rate = 0.01;
  options.noise_margin = 1.0;
  const char* names[] = {"gyro's residuals", "accelerometer's residuals", "pixels' residuals"};
  for (Eigen::Index sensor = 0; sensor < 3; ++sensor) {
    VisualInertialBaResult result = good();
    // Ten residuals of which the fit leaves all: the quantile at 1 % is 23.21.
    setSensor(&result, sensor, 23.0, 10.0, 10.0);
    EXPECT_TRUE(judge(result, options));
    setSensor(&result, sensor, 23.4, 10.0, 10.0);
    const Expected<void> decision = judge(result, options);
    EXPECT_EQ(decision.error().status, RefusalStatus::kNotConverged);
    EXPECT_NEAR(*decision.error().value, 2.34, 1e-12);
    EXPECT_THAT(decision.error().reason, HasSubstr(names[sensor]));
    EXPECT_THAT(decision.error().reason, HasSubstr("chi2/dof 2.34, at most 2.32 is wanted"));
    // Forty of which it leaves a quarter: tr M = 10, tr M^2 = 2.5, so a quarter of a chi-square
    // of forty degrees of freedom, 0.25 * 63.69.
    setSensor(&result, sensor, 15.8, 10.0, 2.5);
    EXPECT_TRUE(judge(result, options));
    setSensor(&result, sensor, 16.1, 10.0, 2.5);
    EXPECT_FALSE(judge(result, options));
  }
  // Twice the noise that is believed: four times its square.
  options.noise_margin = 2.0;
  VisualInertialBaResult result = good();
  setSensor(&result, 0, 92.0, 10.0, 10.0);
  EXPECT_TRUE(judge(result, options));
  setSensor(&result, 0, 94.0, 10.0, 10.0);
  EXPECT_FALSE(judge(result, options));
  // Where three quarters of the residuals are the others' noise: (0.25 * 4 + 0.75) * 15.92.
  setSensor(&result, 0, 27.6, 10.0, 2.5);
  EXPECT_TRUE(judge(result, options));
  setSensor(&result, 0, 28.2, 10.0, 2.5);
  EXPECT_FALSE(judge(result, options));
}

TEST(Acceptance, RefusesABiasByItsDistanceFromThePrior) {
  // Three degrees of freedom, 1 %: 11.34 = 3.37^2.
  VisualInertialBaResult result = good();
  AcceptanceOptions options;
  options.false_alarm_rate = 0.01;
  result.gyro_bias_sigmas = result.accel_bias_sigmas = 3.3;
  EXPECT_TRUE(judge(result, options));
  result.accel_bias_sigmas = 3.45;
  Expected<void> decision = judge(result, options);
  EXPECT_EQ(decision.error().status, RefusalStatus::kImplausible);
  EXPECT_EQ(decision.error().value, 3.45);
  EXPECT_THAT(decision.error().reason, HasSubstr("accelerometer bias is 3.45 standard deviations"));
  result.gyro_bias_sigmas = 3.5;
  EXPECT_THAT(judge(result, options).error().reason,
              HasSubstr("gyro bias is 3.50 standard deviations"));
  EXPECT_TRUE(judge(result, {}));  // 0.001: 4.03
}

TEST(Acceptance, WantsWhatIsPredictedAndSaysWhatIsNotYetKnown) {
  AcceptanceOptions options;
  options.gravity_deg = 1.0;
  options.velocity_mps = 0.05;
  options.gyro_bias_rps = 0.01;
  options.confidence = 0.99;
  Eigen::VectorXd sigma(11);
  // A tilt about x of 0.3 deg, 99 % of which are within 0.77; the rest is known well.
  sigma << 1e-4, 2e-3, 1e-4, 0.1, 0.1, 0.1, 0.3 * M_PI / 180, 1e-5, 1e-4, 1e-4, 0.01;
  const auto verdict = [&](const Eigen::Matrix3d& R_WB) {
    return judgePrediction(sigma.cwiseAbs2().asDiagonal(), R_WB, options);
  };
  EXPECT_TRUE(verdict(Eigen::Matrix3d::Identity()));
  sigma[6] = 0.5 * M_PI / 180;
  Expected<void> decision = verdict(Eigen::Matrix3d::Identity());
  ASSERT_FALSE(decision);
  EXPECT_EQ(decision.error().status, RefusalStatus::kIllConditioned);
  EXPECT_NEAR(*decision.error().value, 0.5 * 2.5758, 1e-3);
  EXPECT_EQ(decision.error().bound, 1.0);
  EXPECT_THAT(decision.error().reason, HasSubstr("1.288 deg (99 %), worst about the body's x"));
  EXPECT_THAT(decision.error().reason, HasSubstr("accelerate sideways"));
  Eigen::Matrix3d turned;  // the body's z along the world's x
  turned << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  EXPECT_THAT(verdict(turned).error().reason, HasSubstr("worst about the body's z"));
  sigma[7] = sigma[6];
  EXPECT_THAT(verdict(turned).error().reason, HasSubstr("alike in all directions"));
  sigma[6] = sigma[7] = 1e-3;
  sigma[10] = 0.03;
  decision = verdict(Eigen::Matrix3d::Identity());
  EXPECT_NEAR(*decision.error().value, 0.03 * 2.5758, 1e-4);
  EXPECT_THAT(decision.error().reason, HasSubstr("worst along the body's z"));
  EXPECT_THAT(decision.error().reason, HasSubstr("something nearer"));
  sigma[10] = 0.01;
  sigma[1] = 5e-3;
  decision = verdict(Eigen::Matrix3d::Identity());
  EXPECT_NEAR(*decision.error().value, 5e-3 * 2.5758, 1e-4);
  EXPECT_THAT(decision.error().reason, HasSubstr("worst about the body's y"));
  options.confidence = 0.9;  // 1.645
  EXPECT_TRUE(verdict(Eigen::Matrix3d::Identity()));
}

TEST(Acceptance, NamesTheKeysInsteadOfThoseThatAreGone) {
  AcceptanceOptions options;
  ParameterSet parameters("acceptance");
  options.declare(parameters);
  const std::pair<const char*, const char*> keys[] = {{"max_chi2_per_dof_inertial", "noise_margin"},
                                                      {"max_accel_bias_mps2", "noise_margin"},
                                                      {"max_sigma_gravity_deg", "gravity_deg"},
                                                      {"max_sigma_velocity_mps", "velocity_mps"},
                                                      {"max_gyro_bias_rps", "gyro_bias_rps"}};
  for (const auto& [old, instead] : keys) {
    try {
      parameters.read(IniFile::fromText(std::string("[acceptance]\n") + old + " = 1\n", "a.ini"));
      FAIL() << old;
    } catch (const ConfigError& e) {
      EXPECT_THAT(e.what(), HasSubstr("a.ini:2"));
      EXPECT_THAT(e.what(), HasSubstr(old));
      EXPECT_THAT(e.what(), HasSubstr(instead));
    }
  }
}

TEST(Acceptance, RefusesACovarianceThatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double value : {nan, infinity})
    for (const Eigen::Index at : {0, 7, 10}) {
      Eigen::MatrixXd covariance = 1e-8 * Eigen::MatrixXd::Identity(11, 11);
      covariance(at, at) = value;
      const Expected<void> decision =
          judgePrediction(covariance, Eigen::Matrix3d::Identity(), AcceptanceOptions());
      ASSERT_FALSE(decision) << value << " at " << at;
      EXPECT_EQ(decision.error().status, RefusalStatus::kIllConditioned);
      EXPECT_EQ(*decision.error().value, infinity);
    }
}

TEST(Acceptance, RefusesWhereHardlyAnyLandmarkIsKnown) {
  VisualInertialBaResult result = good();
  result.bundle.window.measurements.resize(2000);  // 1000 of them of known landmarks
  EXPECT_TRUE(judge(result, {}));
  result.bundle.window.measurements.resize(20'000);
  const Expected<void> decision = judge(result, {});
  EXPECT_EQ(decision.error().status, RefusalStatus::kTooFewTracks);
  EXPECT_EQ(*decision.error().value, 0.05);
  EXPECT_THAT(decision.error().reason, HasSubstr("can be triangulated"));
}

/** The right camera sees three landmarks in ten; at rest the others cannot be triangulated. */
TEST(Acceptance, LandmarksWithoutDepthAtRestDoNotDisagree) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  options.sigma_px = options.assumed_sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.has_right = o.has_right && o.id % 10 < 3;
  Initialization truth;
  truth.states = window.truth;
  truth.bias = window.bias;
  VisualInertialBaOptions ba;
  ba.check_noise = true;
  const VisualInertialBaResult refined = solveVisualInertialBa(
      visualInertialProblem(testing::makeProblem(window, options), truth), ba);
  const int all = refined.bundle.window.measurements.size();
  EXPECT_LT(refined.inlier_measurements, all / 2);  // the share that is wanted
  EXPECT_LT(refined.measurements, all);
  const Expected<void> decision = judge(refined, {});
  EXPECT_TRUE(decision) << decision.error().reason;
}

}  // namespace
}  // namespace etalon
