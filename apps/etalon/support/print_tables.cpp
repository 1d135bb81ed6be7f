#include "support/print_tables.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>

#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_overview.h"
#include "etalon/report/trial_tables.h"

namespace etalon::app {

namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

int widthOfStdout() {
  constexpr int kUnknown = 120;
  if (const int columns = std::atoi(environment("COLUMNS").c_str()); columns > 0) return columns;
  winsize size = {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return kUnknown;
}

/** Counts what crashed or used up its time. */
class Losses {
 public:
  explicit Losses(std::string noun) : noun_(std::move(noun)) {}

  void count(const std::string& what, const std::string& status) {
    if (status == kStatusCrashed || status == kStatusTimeLimit) ++lost_[{what, status}];
  }
  /** Returns whether there are any. */
  bool print() const {
    for (const auto& [what, count] : lost_)
      std::fprintf(stderr, "warning: %s: %s (%s)\n", printable(what.first).c_str(),
                   counted(count, noun_).c_str(), what.second.c_str());
    return !lost_.empty();
  }

 private:
  std::string noun_;
  std::map<std::pair<std::string, std::string>, size_t> lost_;  ///< by what was lost and status
};

}  // namespace

TextStyle textStyle(bool bold) {
  const bool terminal = isatty(STDOUT_FILENO) == 1 && environment("NO_COLOR").empty() &&
                        environment("TERM") != "dumb";
  return {bold || terminal ? CellMark::kTerminalBold : CellMark::kStar, widthOfStdout()};
}

void printOverview(const BenchmarkRecord& record, const TextStyle& style) {
  const std::vector<SummaryRow> summary = summarize(record);
  for (const WindowShape& shape : shapesOf(record))
    std::printf("%s\n",
                toString(overviewTable(record, summary, shape), TableFormat::kText, style).c_str());
}

void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format, bool verbose) {
  const bool text = format == TableFormat::kText;
  if (format == TableFormat::kCsv)
    std::fputs(benchmarkTablesCsv(record).c_str(), stdout);
  else if (text && !verbose)
    printOverview(record, textStyle());
  else
    for (const TitledTable& table : benchmarkTables(record))
      if (table.headline || !text)
        std::printf("\n%s", toString(table, format, textStyle()).c_str());
  std::fflush(stdout);  // keeps the order with stderr in a common log
}

void printTrialTables(const TrialRecord& record, TableFormat format, bool verbose, bool bold) {
  if (format == TableFormat::kCsv)
    std::fputs(runsCsv(record.results).c_str(), stdout);
  else if (format == TableFormat::kText && !verbose)
    std::fputs(trialPage(record, textStyle(bold)).c_str(), stdout);
  else
    for (const TitledTable& table : trialTables(record))
      std::printf("%s\n", toString(table, format, textStyle(bold)).c_str());
  std::fflush(stdout);
}

bool printLost(const BenchmarkRecord& record) {
  Losses losses("result");
  for (const WindowResult& result : record.results)
    losses.count(result.initializer, result.attempt.status);
  return losses.print();
}

bool printLost(const TrialRecord& record) {
  Losses losses("run");
  for (const TrialRun& run : record.results) losses.count(labelOf(run.variant, record), run.status);
  return losses.print();
}

void printShortfalls(const BenchmarkRecord& record) {
  for (const BenchmarkSequence& sequence : record.sequences)
    if (sequence.unreadable_images > 0)
      std::fprintf(stderr,
                   "warning: %s: %d of %d stereo pairs could not be read and were left out\n",
                   sequence.name.c_str(), sequence.unreadable_images, sequence.stereo_frames);
  for (const std::string& sentence : tooShort(record))
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
  for (const std::string& sentence : describeCoverage(record))
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
}

void printShortfalls(const TrialRecord& record) {
  for (const std::vector<std::string>& sentences : {tooShort(record), describeUncounted(record)})
    for (const std::string& sentence : sentences)
      std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
}

}  // namespace etalon::app
