// Called with the path of the plugin; exit code 0 if all is well.
#include <cstdio>
#include <exception>

#include "etalon/contract/contract.h"
#include "etalon/contract/synthetic_window.h"
#include "etalon/initialization/plugin_loader.h"

namespace {

/** Something that only this method promises: b_g is found from two quarters of a second alone. */
bool findsGyroBiasFromThreeKeyframes(const etalon::Initializer& initializer) {
  etalon::testing::SyntheticWindowOptions options;
  options.keyframes = 3;
  options.bias.gyro = {0.02, -0.06, 0.04};
  const auto window = etalon::testing::makeSyntheticWindow(options);
  const auto result = initializer.initialize(etalon::testing::makeProblem(window, options));
  // Noise-free: nothing but the first-order steps of the iteration is left.
  return result.ok() && (result.bias.gyro - options.bias.gyro).norm() < 1e-6;
}

bool keepsTheContract(const etalon::Initializer& initializer) {
  etalon::ContractOptions options;
  options.only = {"exact.", "deterministic"};  // the rest is in contract.loosely_coupled
  const etalon::ContractReport report = etalon::checkContract(initializer, options);
  for (const etalon::ContractCheck& check : report.checks)
    std::printf("%s: %s, %s\n", check.name.c_str(), toString(check.verdict), check.detail.c_str());
  return report.ok();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) return 2;
    const etalon::Initializer::Ptr initializer = etalon::PluginLoader({argv[1]}).create(argv[1]);
    const bool finds = findsGyroBiasFromThreeKeyframes(*initializer);
    std::printf("gyro bias from three keyframes: %s\n", finds ? "found" : "missed");
    return keepsTheContract(*initializer) && finds ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
