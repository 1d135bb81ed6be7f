#include <gtest/gtest.h>

#include "etalon/contract/contract.h"
#include "etalon/contract/synthetic_window.h"
#include "etalon/initialization/plugin_loader.h"

namespace {

/** The plugin as users get it; ETALON_INITIALIZER is its path. */
etalon::Initializer::Ptr load() {
  return etalon::PluginLoader({ETALON_INITIALIZER}).create(ETALON_INITIALIZER);
}

// Something that only this method promises: b_g is found from two quarters of a second alone.
TEST(LooselyCoupled, FindsTheGyroBiasFromThreeKeyframes) {
  etalon::testing::SyntheticWindowOptions options;
  options.keyframes = 3;
  options.bias.gyro = {0.02, -0.06, 0.04};
  const auto window = etalon::testing::makeSyntheticWindow(options);
  const auto result = load()->initialize(etalon::testing::makeProblem(window, options));
  ASSERT_TRUE(result) << result.error().reason;
  // Noise-free: nothing but the first-order steps of the iteration is left.
  EXPECT_LT((result->bias.gyro - options.bias.gyro).norm(), 1e-6);
}

TEST(LooselyCoupled, KeepsTheContract) {
  etalon::ContractOptions options;
  options.only = {"exact.", "deterministic"};  // the rest is in contract.loosely_coupled
  const etalon::ContractReport report = etalon::checkContract(*load(), options);
  EXPECT_FALSE(report.checks.empty());
  for (const etalon::ContractCheck& check : report.checks)
    EXPECT_NE(check.verdict, etalon::ContractCheck::Verdict::kFailed)
        << check.name << ": " << check.detail;
}

}  // namespace
