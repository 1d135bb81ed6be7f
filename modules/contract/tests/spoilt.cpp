#include "spoilt.h"

#include <gtest/gtest.h>

#include <utility>

#include "etalon/initialization/plugin_loader.h"

namespace etalon::testing {

IMPLEMENTS_MRPT_OBJECT(Spoilt, etalon::Initializer, etalon::testing)

Spoilt::Spoilt(Change change) : change_(std::move(change)) {
  good_ = PluginLoader({ETALON_INITIALIZERS}).create("orbslam3_inertial_only");
}

Change ofSuccess(const std::function<void(Initialization*)>& change) {
  return [change](const InitializationProblem&, InitializationResult* result) {
    if (*result) change(&**result);
  };
}

ContractCheck check(const std::string& name, const Initializer& initializer,
                    ContractOptions options) {
  options.only = {name};
  options.limits.cpu_s = 100.0;
  const ContractReport report = checkContract(initializer, options);
  EXPECT_EQ(report.checks.size(), 1U);
  return report.checks.front();
}

}  // namespace etalon::testing
