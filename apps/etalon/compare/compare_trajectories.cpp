#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "compare/compare.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/trial/trajectory_trial.h"
#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/report/plot.h"
#include "support/print_tables.h"
#include "support/systems.h"

namespace etalon::app {

namespace {

namespace fs = std::filesystem;

/** Draws the trajectories that systems have of the whole of the first recording. */
void drawSystems(const CompareArguments& arguments, const std::vector<NamedText>& systems) {
  const std::string& recording = arguments.recordings.front();
  std::vector<NamedTrajectory> trajectories;
  for (const NamedText& system : systems) {
    fs::path file = system.text;
    if (fs::is_directory(file)) file /= recordingName(recording) + ".tum";
    if (fs::exists(file)) trajectories.push_back({system.name, readTum(file.string())});
  }
  SourceOptions options;
  options.decode_images = false;
  drawTrajectories(arguments.plot, trajectories, openSource(recording, options)->groundTruth());
}

/** Says which systems have flown other parts of the recordings than the first. */
void warnOfOtherParts(const TrialRecord& record) {
  std::map<std::string, std::set<std::string>> parts;  // by system
  for (const TrialRun& run : record.results)
    parts[run.variant.system].insert(
        format("%s from %.2f s on", run.recording.c_str(), run.from_s));
  const std::string& first = record.systems.front().name;
  for (const auto& [system, own] : parts)
    if (own != parts[first])
      std::fprintf(stderr, "warning: %s flew %s, %s flew %s: their errors cannot be compared\n",
                   printable(system).c_str(), joined({own.begin(), own.end()}).c_str(),
                   printable(first).c_str(),
                   joined({parts[first].begin(), parts[first].end()}).c_str());
}

}  // namespace

void compareTrajectories(const CompareArguments& arguments, TableFormat format) {
  const std::vector<NamedText> systems = systemsOf(arguments.runs, arguments.recordings.size());
  const TrialRecord record = trialOfTrajectories(systems, arguments.recordings, TrialProtocol());
  if (!arguments.plot.empty()) drawSystems(arguments, systems);
  printTrialTables(record, format, arguments.verbose, arguments.bold);
  warnOfOtherParts(record);
  for (const std::string& sentence : describeUncounted(record))
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
}

}  // namespace etalon::app
