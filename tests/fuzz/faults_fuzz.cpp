// A file of faults.

#include "etalon/simulation/faults/fault_scenario.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  const std::string path =
      fuzz::inFile("faults.ini", std::string(reinterpret_cast<const char*>(data), size));
  fuzz::mayRefuse([&] { readFaultFile(path); });
  return 0;
}
