#include "residuals/bias_prior_cost.h"

#include <gtest/gtest.h>

#include "cost_function_checks.h"

namespace etalon {
namespace {

using testing::expectJacobians;
using testing::residual;

TEST(BiasPriorCost, JacobianAgreesWithDifferencesAndSigmasWhiten) {
  const BiasPriorCost cost({{{0.01, -0.02, 0.03}, {0.1, 0.2, -0.3}}, 0.02, 0.5});
  Eigen::VectorXd bias(6);
  bias << 0.05, 0.04, -0.03, -0.2, 0.1, 0.4;
  expectJacobians(cost, {bias});
  // Gyro first, each in its own sigmas.
  const Eigen::VectorXd r = residual(cost, {bias});
  EXPECT_NEAR(r[0], 0.04 / 0.02, 1e-12);
  EXPECT_NEAR(r[3], -0.3 / 0.5, 1e-12);
}

}  // namespace
}  // namespace etalon
