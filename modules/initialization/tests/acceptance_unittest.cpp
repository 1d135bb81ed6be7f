#include "etalon/initialization/acceptance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "etalon/core/errors.h"

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

TEST(Acceptance, NamesTheKeysInsteadOfThoseThatAreGone) {
  AcceptanceOptions options;
  ParameterSet parameters("acceptance");
  options.declare(parameters);
  for (const char* old :
       {"max_chi2_per_dof_inertial", "max_gyro_bias_rps", "max_accel_bias_mps2"}) {
    try {
      parameters.read(IniFile::fromText(std::string("[acceptance]\n") + old + " = 1\n", "a.ini"));
      FAIL() << old;
    } catch (const ConfigError& e) {
      EXPECT_THAT(e.what(), HasSubstr("a.ini:2"));
      EXPECT_THAT(e.what(), HasSubstr(old));
      EXPECT_THAT(e.what(), HasSubstr("noise_margin"));
    }
  }
}

}  // namespace
}  // namespace etalon
