#pragma once

#include <nlohmann/json.hpp>

#include "etalon/benchmark/benchmark_record.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {

constexpr const char* kBenchmarkFormat = "etalon benchmark";
/** Raised when the meaning of a key changes. */
constexpr int kBenchmarkFormatVersion = 1;

/** A record without its slots. */
nlohmann::ordered_json benchmarkHeadJson(const BenchmarkRecord& record);
BenchmarkRecord benchmarkHeadFromJson(const JsonReader& json);

nlohmann::ordered_json slotJson(const SlotRecord& slot);
SlotRecord slotFromJson(const JsonReader& json);

}  // namespace etalon
