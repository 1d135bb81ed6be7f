#pragma once

#include <nlohmann/json.hpp>

#include "etalon/benchmark/record.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {

constexpr const char* kBenchmarkFormat = "etalon benchmark";
/** Raised when the meaning of a key changes. */
constexpr int kBenchmarkFormatVersion = 1;

/** A record without its windows. */
nlohmann::ordered_json benchmarkHeadJson(const BenchmarkRecord& record);
BenchmarkRecord benchmarkHeadFromJson(const JsonReader& json);

nlohmann::ordered_json resultJson(const WindowResult& result);
WindowResult resultFromJson(const JsonReader& json);

}  // namespace etalon
