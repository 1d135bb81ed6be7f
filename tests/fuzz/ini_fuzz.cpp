// A run's configuration, and with it the parameters of every section.

#include "etalon/pipeline/run_configuration.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::mayRefuse([&] {
    IniFile ini = IniFile::fromText(text, "run.ini");
    loadRunConfiguration(ini, {});
  });
  return 0;
}
