#include "etalon/benchmark/trial/trial_store.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "suite/suite_files.h"
#include "trial/trial_json.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeadName = "trial.json";
constexpr const char* kRunsName = "runs.csv";
constexpr const char* kReportName = "report.html";

/** Every run that a complete record has, with nothing but its identity, in order. */
std::vector<TrialRun> expectedRuns(const TrialRecord& record) {
  const std::vector<TrialVariant> variants = variantsOf(record);
  std::vector<TrialRun> runs;
  TrialRun run;
  for (const BenchmarkSequence& sequence : record.sequences) {
    if (!sequence.error.empty()) continue;
    run.recording = sequence.name;
    for (const double from_s : startsOf(record.protocol, sequence)) {
      run.from_s = from_s;
      for (const TrialVariant& variant : variants) {
        run.variant = variant;
        for (const NamedText& fault : record.faults) {
          run.fault = fault.name;
          runs.push_back(run);
        }
      }
    }
  }
  return runs;
}

std::string differenceOfProtocols(const TrialProtocol& a, const TrialProtocol& b) {
  if (a.seconds != b.seconds || a.starts != b.starts || a.from_s != b.from_s)
    return "other parts of the recordings (--starts, --from, --seconds)";
  if (a.ate_limit_m != b.ate_limit_m) return "another limit of the ATE";
  return a.seed != b.seed ? "another seed" : "";
}

}  // namespace

bool isTrialFolder(const std::string& folder) { return fs::exists(pathIn(folder, kHeadName)); }

TrialRecord readTrialHead(const std::string& folder) {
  const std::string path = pathIn(folder, kHeadName);
  const nlohmann::json json = parseJson(readText(path), path, 0);
  return trialHeadFromJson(JsonReader(json, path));
}

TrialRecord readTrial(const std::string& folder) {
  TrialRecord record = readTrialHead(folder);
  LineStore store(pathIn(folder, "runs"));
  for (const BenchmarkSequence& sequence : record.sequences)
    store.read(sequence.name, [&record](const std::string& line, const std::string& place) {
      record.results.push_back(trialRunFromText(line, place));
    });
  sortResults(&record);
  return record;
}

void writeTrialHead(const std::string& folder, const TrialRecord& record) {
  makeFolder(pathIn(folder, "runs"));
  OutputFiles output(folder);
  writeFile(output.path(kHeadName), jsonText(trialHeadJson(record), 1) + "\n");
  writeFile(output.path("config.ini"), record.config);
  output.putInPlace();
}

std::vector<std::string> writeTrialResults(const std::string& folder, const TrialRecord& record,
                                           const TrialReport& report) {
  OutputFiles output(folder);
  std::vector<std::string> paths = {pathIn(folder, kRunsName)};
  writeFile(output.path(kRunsName), runsCsv(record.results));
  if (report) {
    paths.push_back(pathIn(folder, kReportName));
    writeFile(output.path(kReportName), report(record, folder));
  }
  output.putInPlace();
  return paths;
}

bool hasTrialResults(const std::string& folder) { return fs::exists(pathIn(folder, kRunsName)); }

void discardTrial(const std::string& folder) {
  for (const char* name : {kRunsName, kReportName, "runs", "trajectories"})
    fs::remove_all(pathIn(folder, name));
}

std::string resultToText(const TrialRun& run) { return jsonText(trialRunJson(run), -1); }

TrialRun trialRunFromText(const std::string& text, const std::string& place) {
  const nlohmann::json json = parseJson(text, place, 0);
  return trialRunFromJson(JsonReader(json, place));
}

std::string trajectoryPath(const std::string& folder, const TrialRecord& record,
                           const TrialRun& run) {
  for (const NamedText& system : record.systems) {
    if (run.variant.system != system.name) continue;
    const std::string path =
        pathIn(system.text, trajectoryName(run.recording, run.from_s, run.fault));
    const std::string whole = pathIn(system.text, run.recording + ".tum");
    const bool is_whole = run.from_s == 0.0 && run.fault == kNoFault;
    return is_whole && !fs::exists(path) && fs::exists(whole) ? whole : path;
  }
  return (fs::path(folder) / "trajectories" / folderName(run.variant) /
          trajectoryName(run.recording, run.from_s, run.fault))
      .string();
}

std::string groundTruthPath(const std::string& folder, const std::string& recording,
                            double from_s) {
  return pathIn(folder, "trajectories/ground_truth/" + trajectoryName(recording, from_s, kNoFault));
}

void sortResults(TrialRecord* record) {
  std::map<std::string, size_t> places;
  for (const TrialRun& run : expectedRuns(*record)) places.emplace(resultKey(run), places.size());
  std::vector<std::pair<size_t, size_t>> order;
  for (size_t i = 0; i < record->results.size(); ++i) {
    const auto place = places.find(resultKey(record->results[i]));
    if (place != places.end()) order.emplace_back(place->second, i);
  }
  std::sort(order.begin(), order.end());
  std::vector<TrialRun> sorted;
  sorted.reserve(order.size());
  for (const auto& [place, i] : order) sorted.push_back(std::move(record->results[i]));
  record->results = std::move(sorted);
}

std::vector<std::string> missingResults(const TrialRecord& record) {
  std::set<std::string> there;
  for (const TrialRun& run : record.results) there.insert(resultKey(run));
  std::vector<std::string> missing;
  for (const TrialRun& run : expectedRuns(record))
    if (there.count(resultKey(run)) == 0) missing.push_back(resultKey(run));
  return missing;
}

std::string differenceOf(const TrialRecord& a, const TrialRecord& b) {
  std::string difference = differenceOfProtocols(a.protocol, b.protocol);
  if (difference.empty() && a.faults != b.faults) difference = "other faults";
  if (difference.empty() && (a.settings != b.settings || a.odometries != b.odometries))
    difference = "other settings or odometries";
  if (difference.empty() && a.systems != b.systems) difference = "other systems";
  return differenceOfSuites(a, b, difference);
}

}  // namespace etalon
