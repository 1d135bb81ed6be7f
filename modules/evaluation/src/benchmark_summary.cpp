#include "etalon/evaluation/benchmark_summary.h"

namespace etalon {

std::string summaryCsv(const BenchmarkRecord&) { return {}; }

}  // namespace etalon
