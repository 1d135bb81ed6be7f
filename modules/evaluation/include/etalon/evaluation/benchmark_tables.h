#pragma once

#include <string>
#include <vector>

#include "etalon/evaluation/benchmark_record.h"
#include "etalon/evaluation/comparison_table.h"

namespace etalon {

struct TitledTable {
  std::string title;
  std::string note;  ///< what to know when reading it; may be empty
  Table table;
};

/**
 * The tables of a benchmark: errors in the layout of the paper's Tables I and II (without and with
 * VI-BA; a row a sequence, and one over all; the initializers beside each other), run time,
 * success, gravity and velocity, the floor of the ground truth, the check of the noise.
 */
std::vector<TitledTable> benchmarkTables(const BenchmarkRecord& record);

}  // namespace etalon
