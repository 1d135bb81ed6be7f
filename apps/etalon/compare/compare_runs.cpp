#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "compare/compare.h"
#include "compare/folder_names.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/report/comparison_table.h"
#include "etalon/report/plot.h"
#include "etalon/runlog/run_log.h"

namespace etalon::app {

namespace {

/** Draws the runs' trajectories, with the ground truth of their recording where it is still there. */
void drawRuns(const CompareArguments& arguments,
              const std::vector<std::pair<std::string, RunRecord>>& runs) {
  std::vector<NamedTrajectory> trajectories;
  for (size_t i = 0; i < runs.size(); ++i)
    trajectories.push_back(
        {runs[i].first, readTum((folderOf(arguments.runs[i]) / "trajectory.tum").string())});
  GroundTruth truth;
  SourceOptions options;
  options.decode_images = false;
  try {
    truth = openSource(runs.front().second.source, options)->groundTruth();
  } catch (const DataError& error) {
    std::fprintf(stderr, "warning: drawn without ground truth: %s\n",
                 printable(error.what()).c_str());
  }
  drawTrajectories(arguments.plot, trajectories, truth);
}

/** @throws ConfigError for a trial, and for a folder that holds runs and is none itself */
void requireRun(const std::string& path) {
  namespace fs = std::filesystem;
  if (isTrialFolder(path))
    throw ConfigError("compare: '" + path +
                      "' is a trial; its tables are in its report.html and runs.csv. Expected runs "
                      "(etalon replay) or benchmarks (etalon bench)");
  if (!fs::is_directory(path) || fs::exists(fs::path(path) / kRunLogName)) return;
  std::vector<std::string> runs;
  for (const auto& entry : fs::directory_iterator(path))
    if (fs::exists(entry.path() / kRunLogName)) runs.push_back(entry.path().string());
  std::sort(runs.begin(), runs.end());
  if (!runs.empty())
    throw ConfigError("compare: '" + path +
                      "' is no run, but runs are in it; expected them: " + joined(runs, " "));
}

/** Leaves out the attempts after a run's first start: the tables are of that start. */
void keepFirstStart(RunRecord* record) {
  if (const AttemptRecord* first = record->acceptedAttempt())
    record->attempts.resize(static_cast<size_t>(first - record->attempts.data()) + 1);
}

/** @throws ConfigError if the runs are of several recordings, which have no common time axis */
void requireOneRecording(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  constexpr double kLongestFlightS = 86400.0;
  const auto& [first_name, first] = runs.front();
  for (const auto& [name, run] : runs) {
    const std::string other = recordingName(run.source), recording = recordingName(first.source);
    const double later_s = secondsBetween(first.first_image, run.first_image);
    if (other == recording && std::abs(later_s) < kLongestFlightS) continue;
    const std::string of = other == recording
                               ? format("both are of %s, but of different days", recording.c_str())
                               : format("%s is of %s, %s of %s", first_name.c_str(),
                                        recording.c_str(), name.c_str(), other.c_str());
    throw ConfigError(
        "--save-plot: expected runs of one recording, which have time and ground truth in "
        "common; " +
        of);
  }
}

/** Says which runs are of another recording, or of another part of it, than the first. */
void warnOfOtherRecordings(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  constexpr double kToleranceS = 0.2;  // a fault may have taken the first or last images
  const auto& [first_name, first] = runs.front();
  const std::string recording = recordingName(first.source);
  for (const auto& [name, run] : runs) {
    const std::string other = recordingName(run.source);
    const double later_s = secondsBetween(first.first_image, run.first_image);
    const double longer_s = run.statistics.duration_s - first.statistics.duration_s;
    const bool same_part = std::abs(later_s) <= kToleranceS && std::abs(longer_s) <= kToleranceS;
    if (same_part && other == recording) continue;
    std::string what =
        format("of another recording (%s, not %s)", other.c_str(), recording.c_str());
    if (other == recording)
      what = format("of another part of %s (%.2f s, which begin %+.2f s after those %.2f s)",
                    recording.c_str(), run.statistics.duration_s, later_s,
                    first.statistics.duration_s);
    std::fprintf(stderr, "warning: %s is a run %s than %s: their errors cannot be compared\n",
                 printable(name).c_str(), printable(what).c_str(), printable(first_name).c_str());
  }
}

}  // namespace

void compareRunFolders(const CompareArguments& arguments, TableFormat format) {
  const std::vector<std::string> names =
      isForPeople(format) ? shortNames(arguments.runs) : arguments.runs;
  for (const std::string& path : arguments.runs) requireRun(path);
  std::vector<std::pair<std::string, RunRecord>> runs;
  for (size_t i = 0; i < names.size(); ++i)
    runs.emplace_back(names[i], readRunRecord(arguments.runs[i]));
  const double min_coverage = arguments.min_coverage.value_or(kMinCoverage);
  if (!arguments.plot.empty()) requireOneRecording(runs);
  for (auto& [name, record] : runs) {
    requireCoverage(&record, min_coverage);
    keepFirstStart(&record);
  }
  warnOfOtherRecordings(runs);
  const bool brief = format == TableFormat::kText && !arguments.verbose;
  const Table table = brief ? compareRunsBriefly(runs) : compareRuns(runs);
  std::fputs(table.toString(format).c_str(), stdout);
  for (const auto& [name, record] : runs) {
    if (!record.ground_truth) continue;
    const std::string partly = describeCoverage(*record.ground_truth, min_coverage);
    if (!partly.empty()) std::fprintf(stderr, "warning: %s: %s\n", name.c_str(), partly.c_str());
  }
  if (!arguments.plot.empty()) drawRuns(arguments, runs);
  const std::vector<std::string> refusals = refusalsOf(runs);
  if ((format == TableFormat::kText || format == TableFormat::kMarkdown) && !refusals.empty()) {
    std::printf("\n");
    for (const std::string& sentence : refusals) std::printf("%s\n", sentence.c_str());
  }
}

}  // namespace etalon::app
