#include "options/fault_option.h"

#include "etalon/simulation/faults/faulty_source.h"
#include "support/checks.h"

namespace etalon::app {

void FaultOption::add(CLI::App* command) {
  command->add_option("--fault", text,
                      "Faults that happen to the recording, as on a line of config/faults.ini: "
                      "\"covered from=8 for=1, lost percent=10\"");
  command->add_option("--fault-seed", seed, "Seed of the faults' random numbers")
      ->check(checkWholeNumber())
      ->capture_default_str();
}

std::unique_ptr<SensorSource> FaultOption::apply(
    const std::function<std::unique_ptr<SensorSource>()>& open, double start_s) const {
  const FaultScenario scenario = parseFaultScenario("", text);
  if (scenario.faults.empty()) return open();
  return withFaults(open(), scenario, start_s, seed);
}

}  // namespace etalon::app
