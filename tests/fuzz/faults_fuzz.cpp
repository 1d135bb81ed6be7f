// A file of faults.

#include "etalon/simulation/faults/fault_scenario.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::faults(const std::uint8_t* data, std::size_t size) {
  const std::string path =
      inFile("faults.ini", std::string(reinterpret_cast<const char*>(data), size));
  mayRefuse([&] { readFaultFile(path); });
}
