#include <cstdio>
#include <filesystem>

#include "compare/compare.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/trial/trajectory_trial.h"
#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/core/printable.h"
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

}  // namespace

void compareTrajectories(const CompareArguments& arguments, TableFormat format) {
  const std::vector<NamedText> systems = systemsOf(arguments.runs, arguments.recordings.size());
  const TrialRecord record = trialOfTrajectories(systems, arguments.recordings, TrialProtocol());
  if (!arguments.plot.empty()) drawSystems(arguments, systems);
  printTrialTables(record, format, arguments.verbose, arguments.bold);
  for (const std::string& sentence : describeUncounted(record))
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
}

}  // namespace etalon::app
