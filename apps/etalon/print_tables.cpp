#include "print_tables.h"

#include <cstdio>

namespace etalon::app {

void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format) {
  const bool for_people = format == TableFormat::kText || format == TableFormat::kMarkdown;
  for (const TitledTable& table : benchmarkTables(record)) {
    if (for_people) {
      std::printf("\n%s%s\n", format == TableFormat::kMarkdown ? "### " : "", table.title.c_str());
      if (!table.note.empty()) std::printf("%s\n", table.note.c_str());
      std::printf("\n");
    }
    std::fputs(table.table.toString(format).c_str(), stdout);
  }
}

}  // namespace etalon::app
