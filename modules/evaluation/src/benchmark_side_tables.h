#pragma once

#include <optional>
#include <string>
#include <utility>

#include "etalon/evaluation/benchmark_tables.h"

// The tables of a benchmark that are not in the papers' layout. See benchmarkTables().

namespace etalon {

using Window = std::pair<int, double>;  ///< keyframes, rate_hz

std::string windowText(const Window& window);
/** For TitledTable::id. */
std::string windowId(const Window& window);

/** Step 1, initializer, its own stages, VI-BA: times over all sequences. */
TitledTable runtimePartsTable(const BenchmarkRecord& record, const Window& window);

/** The noise in use against the residuals after the first initializer that has a check; nothing if
 * none has. */
std::optional<TitledTable> noiseTable(const BenchmarkRecord& record, const Window& window);

/** What the ground truth of each sequence is worth. */
TitledTable floorTable(const BenchmarkRecord& record);

}  // namespace etalon
