// Writes the reports that the browser test opens: write_report_examples FOLDER
#include <cstdio>
#include <fstream>

#include "../report_example.h"
#include "etalon/report/report.h"

namespace {

bool write(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) std::fprintf(stderr, "cannot write %s\n", path.c_str());
  return static_cast<bool>(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  const std::string folder = argv[1];
  const etalon::testing::RunExample run = etalon::testing::runExample();
  const bool written = write(folder + "/benchmark.html",
                             etalon::benchmarkReportHtml(etalon::testing::reportExample({}))) &&
                       write(folder + "/run.html",
                             etalon::runReportHtml(run.record, run.estimates, run.ground_truth));
  return written ? 0 : 1;
}
