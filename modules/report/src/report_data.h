#pragma once

#include <nlohmann/json.hpp>

#include "etalon/benchmark/record.h"

namespace etalon {

/**
 * What the report's scripts draw, in compact form: names, statuses and reasons once each, results
 * as arrays that refer to them, numbers rounded to 6 digits, NaN as null, positions as whole
 * multiples of 10 um. page/data.js reads it and has the layout.
 */
nlohmann::json reportData(const BenchmarkRecord& record);

}  // namespace etalon
