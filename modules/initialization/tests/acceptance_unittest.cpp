#include "etalon/initialization/acceptance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace etalon {
namespace {

using ::testing::HasSubstr;

/** Passes every gate. */
VisualInertialBaResult good() {
  VisualInertialBaResult result;
  result.converged = true;
  result.last_step_sigmas = 0.02;
  result.iterations = 7;
  result.states.resize(2);
  result.dof_inertial = 81;
  result.measurements = 1000;
  result.inlier_measurements = 950;
  result.covariance = 1e-6 * Eigen::MatrixXd::Identity(24, 24);
  return result;
}

TEST(Acceptance, TakesWhatConvergedAndRefusesWhatDidNot) {
  EXPECT_TRUE(judge(good(), {}).accepted);
  VisualInertialBaResult stopped = good();
  stopped.converged = false;
  stopped.last_step_sigmas = 0.87;
  stopped.iterations = 100;
  const AcceptanceDecision decision = judge(stopped, {});
  EXPECT_FALSE(decision.accepted);
  EXPECT_EQ(decision.status, InitializationStatus::kNotConverged);
  EXPECT_EQ(decision.value, 0.87);
  EXPECT_THAT(decision.reason, HasSubstr("last step was 0.87 standard deviations long"));
  EXPECT_THAT(decision.reason, HasSubstr("100 iterations"));
}

}  // namespace
}  // namespace etalon
