// Writes the reports that the browser test opens: write_report_examples FOLDER
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>

#include "../report_example.h"
#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/report/report.h"
#include "etalon/testing/example_trial.h"

namespace {

bool write(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) std::fprintf(stderr, "cannot write %s\n", path.c_str());
  return static_cast<bool>(file);
}

/** The report of the example's trial, whose trajectories are written into `folder`. */
std::string trialReport(const std::string& folder) {
  const etalon::TrialRecord record = etalon::testing::exampleTrial();
  for (const etalon::TrialRun& run : record.results) {
    etalon::Trajectory truth, flown;
    for (int k = 0; k < 200; ++k) {
      const double s = 0.05 * k;
      const etalon::TimeNs t = etalon::durationNs(run.from_s + s);
      truth.push_back({t, {Eigen::Matrix3d::Identity(), {std::cos(s), std::sin(s), 0.1 * s}}});
      flown.push_back(truth.back());
      flown.back().T_WB.t.x() += run.causal.ate_m * s;
    }
    for (const auto& [path, trajectory] :
         {std::pair(etalon::groundTruthPath(folder, run.recording, run.from_s), truth),
          std::pair(etalon::trajectoryPath(folder, record, run), flown)}) {
      std::filesystem::create_directories(std::filesystem::path(path).parent_path());
      etalon::writeTum(path, trajectory);
    }
  }
  return etalon::trialReportHtml(record, folder);
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
                             etalon::runReportHtml(run.record, run.estimates, run.ground_truth)) &&
                       write(folder + "/trial.html", trialReport(folder + "/trial"));
  return written ? 0 : 1;
}
