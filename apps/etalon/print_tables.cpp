#include "print_tables.h"

#include <cstdio>

namespace etalon::app {

void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format) {
  const bool text = format == TableFormat::kText;
  for (const TitledTable& table : benchmarkTables(record))
    if (table.headline || !text) std::printf("\n%s", toString(table, format).c_str());
  std::fflush(stdout);  // what follows on stderr follows in a common log, too
}

}  // namespace etalon::app
