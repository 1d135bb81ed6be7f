#include "support/read_summary.h"

#include <algorithm>
#include <cstdio>

#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/datasets/sensor_source.h"

namespace etalon::app {

void printReadProblems(int unreadable_pairs, const std::vector<std::string>& warnings) {
  if (unreadable_pairs > 0) {
    const auto named = std::count_if(warnings.begin(), warnings.end(), [](const std::string& w) {
      return w.find(kSkippedMark) != std::string::npos;
    });
    const std::string partly =
        named < unreadable_pairs ? " (first " + std::to_string(named) + " named)" : "";
    std::printf("%s could not be read and %s skipped%s\n",
                counted(unreadable_pairs, "stereo pair").c_str(),
                unreadable_pairs == 1 ? "was" : "were", partly.c_str());
    std::fflush(stdout);
  }
  for (const std::string& warning : warnings)
    std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
}

}  // namespace etalon::app
