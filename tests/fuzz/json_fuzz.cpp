// initialization.json, and a line of a benchmark's results.

#include "etalon/benchmark/store.h"
#include "etalon/runlog/initialization_json.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::json(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  mayRefuse([&] { runRecordFromJson(text, "run"); });
  mayRefuse([&] { resultFromText(text); });
}
