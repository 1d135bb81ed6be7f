// initialization.json, and a line of a benchmark's results.

#include "etalon/benchmark/store.h"
#include "etalon/runlog/initialization_json.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::mayRefuse([&] { runRecordFromJson(text, "run"); });
  fuzz::mayRefuse([&] { resultFromText(text); });
  return 0;
}
