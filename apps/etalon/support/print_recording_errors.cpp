#include "support/print_recording_errors.h"

#include <cstdio>

#include "etalon/core/printable.h"

namespace etalon::app {

bool printRecordingErrors(const SuiteRecord& record) {
  bool any = false;
  for (const BenchmarkSequence& sequence : record.sequences) {
    if (sequence.error.empty()) continue;
    std::fprintf(stderr, "error: %s was left out: %s\n", printable(sequence.name).c_str(),
                 printable(sequence.error).c_str());
    any = true;
  }
  return any;
}

void printRecordingWarnings(const SuiteRecord& record) {
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const std::string& warning : sequence.warnings)
      std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
}

}  // namespace etalon::app
