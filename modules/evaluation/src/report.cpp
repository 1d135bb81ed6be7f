#include "etalon/evaluation/report.h"

namespace etalon {

std::string benchmarkReportHtml(const BenchmarkRecord&) { return {}; }

}  // namespace etalon
