// A run's configuration, and with it the parameters of every section.

#include "etalon/pipeline/run_configuration.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::ini(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  mayRefuse([&] {
    IniFile ini = IniFile::fromText(text, "run.ini");
    loadRunConfiguration(ini, {});
  });
}
