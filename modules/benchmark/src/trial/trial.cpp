#include "etalon/benchmark/trial/trial.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "etalon/benchmark/content_hash.h"
#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"
#include "etalon/core/output_file.h"
#include "etalon/core/stopwatch.h"
#include "etalon/core/text.h"
#include "suite/merger.h"
#include "suite/open_recordings.h"
#include "suite/parallel.h"
#include "suite/progress_report.h"
#include "suite/suite_files.h"
#include "trial/trial_worker.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

void requireUnique(const std::vector<NamedText>& named, const std::string& what) {
  std::set<std::string> names;
  for (const NamedText& one : named)
    if (!names.insert(one.name).second)
      throw ConfigError("two " + what + " are called '" + one.name + "'; expected different names");
}

std::vector<NamedText> named(const std::vector<std::string>& names) {
  std::vector<NamedText> all;
  for (const std::string& name : names) all.push_back({name, ""});
  return all;
}

class Trial {
 public:
  Trial(const std::vector<TrialSetting>& settings, TrialOptions options)
      : settings_(settings), options_(std::move(options)), store_(pathIn(options_.out, "runs")) {}

  TrialOutcome run() {
    describe();
    recordings_ = openRecordings(options_.sources, options_.ground_truth, &record_.sequences);
    requireRuns();
    makeFolder(options_.out);
    const FolderLock lock(options_.out);
    adoptFormerRun();
    writeTrialHead(options_.out, record_);
    chooseTasks();
    Stopwatch watch;
    readContents();
    writeTrialHead(options_.out, record_);
    if (!stopped()) makeRuns();
    outcome_.wall_s = 1e-3 * watch.lapMilliseconds();
    finish();
    return std::move(outcome_);
  }

 private:
  bool stopped() const { return options_.stop && options_.stop->load(); }

  void describe() {
    record_.protocol = options_.protocol;
    record_.versions = options_.versions;
    record_.binaries = programHash();
    record_.shard = options_.shard;
    record_.shards = options_.shards;
    record_.initializers = initializerRecords(settings_.front().configuration.initializers);
    for (const TrialSetting& setting : settings_) {
      std::string config = setting.configuration.pipeline_ini;
      for (const ConfiguredInitializer& initializer : setting.configuration.initializers)
        config += initializer.ini + "\n";
      record_.settings.push_back({setting.name, config});
      record_.config += (setting.name.empty() ? "" : "; setting " + setting.name + "\n") + config;
    }
    record_.odometries = options_.odometries;
    if (record_.odometries.empty())
      record_.odometries = {settings_.front().configuration.pipeline.odometry_kind};
    options_.odometries = record_.odometries;
    putPlainFirst();
    for (const FaultScenario& fault : options_.faults)
      record_.faults.push_back({fault.name, fault.text});
    for (const NamedText& system : options_.systems) {
      if (!fs::is_directory(system.text))
        throw ConfigError("there is no folder '" + system.text + "' of trajectories");
      record_.systems.push_back(
          {system.name, fs::absolute(system.text).lexically_normal().string()});
    }
    requireUnique(record_.settings, "settings");
    requireUnique(record_.faults, "faults");
    requireUnique(record_.systems, "systems");
    requireUnique(named(record_.odometries), "odometries");
    std::vector<std::string> instants;
    for (const double from_s : record_.protocol.from_s) instants.push_back(format("%g s", from_s));
    requireUnique(named(instants), "instants (--from)");
    for (const NamedText& system : record_.systems)
      for (const BenchmarkInitializer& initializer : record_.initializers)
        if (initializer.name == system.name)
          throw ConfigError("the system '" + system.name +
                            "' is called like an initializer; expected another name, e.g. "
                            "--system their_" +
                            system.name + "=" + system.text);
  }

  /** @throws ConfigError if there are recordings, and none is long enough */
  void requireRuns() const {
    bool any_opened = false;
    for (const BenchmarkSequence& sequence : record_.sequences) {
      if (!sequence.error.empty()) continue;
      any_opened = true;
      if (!startsOf(record_.protocol, sequence).empty()) return;
    }
    if (any_opened)
      throw ConfigError("no run is left: " + joined(tooShort(record_), "; ") +
                        "; expected longer recordings, or a smaller --seconds or --from");
  }

  /** The scenario without a fault comes first, given or not. */
  void putPlainFirst() {
    auto& faults = options_.faults;
    const auto there = std::find_if(faults.begin(), faults.end(),
                                    [](const FaultScenario& f) { return f.name == kNoFault; });
    FaultScenario none;
    none.name = kNoFault;
    if (there != faults.end()) {
      if (!there->faults.empty())
        throw ConfigError(std::string("the scenario '") + kNoFault + "' has a fault");
      faults.erase(there);
    }
    faults.insert(faults.begin(), none);
  }

  /** Finds the runs that an interrupted trial of the same kind has finished. */
  void adoptFormerRun() {
    if (!isTrialFolder(options_.out)) return;
    if (options_.overwrite) {
      discardTrial(options_.out);
      return;
    }
    TrialRecord former = readTrial(options_.out);
    std::string difference = differenceOf(former, record_);
    if (difference.empty() && (former.shard != record_.shard || former.shards != record_.shards))
      difference = "it is another shard";
    if (!difference.empty())
      throw ConfigError("'" + options_.out + "' holds a trial that cannot be resumed: " +
                        difference + "; choose another --out, or --overwrite it");
    for (size_t i = 0; i < record_.sequences.size(); ++i)
      record_.sequences[i].content = former.sequences[i].content;
    for (TrialRun& run : former.results) {
      finished_.insert(resultKey(run));
      record_.results.push_back(std::move(run));
    }
    outcome_.runs_found = record_.results.size();
  }

  /** The tasks of this shard, in order, less the runs that are finished. */
  void chooseTasks() {
    std::vector<TrialTask> all;
    size_t cuts = 0;
    const std::vector<TrialVariant> variants = variantsOf(record_);
    for (size_t s = 0; s < recordings_.size(); ++s) {
      if (!recordings_[s]) continue;
      for (const double from_s : startsOf(record_.protocol, record_.sequences[s])) {
        for (const TrialVariant& variant : variants) all.push_back({s, from_s, cuts, variant, {}});
        ++cuts;
      }
    }
    // A shard is one contiguous piece, so that it needs few recordings.
    const size_t shard = options_.shard, shards = options_.shards;
    const size_t begin = all.size() * (shard - 1) / shards, end = all.size() * shard / shards;
    TrialRun run;
    for (size_t i = begin; i < end; ++i) {
      TrialTask task = all[i];
      needed_.insert(task.sequence);
      run.recording = record_.sequences[task.sequence].name;
      run.from_s = task.from_s;
      run.variant = task.variant;
      for (size_t f = 0; f < record_.faults.size(); ++f) {
        run.fault = record_.faults[f].name;
        if (finished_.count(resultKey(run)) == 0) task.faults.push_back(f);
      }
      runs_ += task.faults.size();
      if (!task.faults.empty()) tasks_.push_back(std::move(task));
    }
  }

  /** Hashes the recordings that are needed, so that runs of others are never joined to them. */
  void readContents() {
    const std::vector<size_t> needed(needed_.begin(), needed_.end());
    inParallel(options_.jobs, needed.size(), [&](size_t i) {
      if (stopped()) return;
      BenchmarkSequence& sequence = record_.sequences[needed[i]];
      const std::string content = contentOf(*recordings_[needed[i]]);
      if (!sequence.content.empty() && sequence.content != content)
        throw ConfigError("'" + options_.out + "' has runs of '" + sequence.name +
                          "', but the recording or its ground truth has changed since; choose "
                          "another --out, or --overwrite it");
      sequence.content = content;
      recordings_[needed[i]].reset();
    });
  }

  void makeRuns() {
    makeFolder(pathIn(options_.out, "trajectories/ground_truth"));
    for (const TrialVariant& variant : variantsOf(record_))
      if (variant.system.empty())
        makeFolder(pathIn(options_.out, "trajectories/" + folderName(variant)));
    ProgressReport progress(options_.progress, BenchmarkProgress::Stage::kRuns, runs_);
    TrialWorker worker(settings_, options_, record_);  // each process has a copy
    IsolatedWork work;
    work.items = tasks_.size();
    work.parts = [this](size_t i) { return tasks_[i].faults.size(); };
    work.group = [this](size_t i) { return tasks_[i].cut; };
    work.run = [&](size_t i, size_t first, const DoPart& do_part) {
      worker.run(tasks_[i], first, do_part);
    };
    work.finished = [&](size_t i, size_t, const std::string& text) {
      TrialRun run = trialRunFromText(text);
      if (options_.warn && (run.status == kStatusCrashed || run.status == kStatusTimeLimit))
        options_.warn(resultKey(run) + ": " + run.reason);
      store_.append(record_.sequences[tasks_[i].sequence].name, text);
      record_.results.push_back(std::move(run));
      ++outcome_.runs_made;
      progress.add(1);
    };
    // Runs have processes of their own: what ends a worker ends its work, not the trial.
    work.died = [&](size_t i, size_t, const std::string& how, bool) {
      if (options_.warn)
        options_.warn(record_.sequences[tasks_[i].sequence].name + ": a worker process " + how +
                      "; its run is made by the next call");
    };
    work.item_done = [](size_t) {};
    work.stopped = [this] { return stopped(); };
    work.stopping = options_.stopping;
    runIsolatedWork(options_.jobs, options_.time_limit_s, work);
  }

  void finish() {
    outcome_.runs_missing = runs_ - outcome_.runs_made;
    outcome_.interrupted = outcome_.runs_missing > 0;
    sortResults(&record_);
    if (!outcome_.interrupted)
      outcome_.files = writeTrialResults(options_.out, record_, options_.report);
    outcome_.record = std::move(record_);
  }

  const std::vector<TrialSetting>& settings_;
  TrialOptions options_;
  LineStore store_;
  TrialRecord record_;
  TrialOutcome outcome_;
  std::vector<std::unique_ptr<RecordedSource>> recordings_;  ///< null where it cannot be read
  std::set<std::string> finished_;                           ///< resultKey()s
  std::set<size_t> needed_;                                  ///< sequences of this shard
  std::vector<TrialTask> tasks_;
  size_t runs_ = 0;  ///< of tasks_
};

}  // namespace

TrialOutcome runTrial(const std::vector<TrialSetting>& settings, const TrialOptions& options) {
  return Trial(settings, options).run();
}

TrialOutcome mergeTrials(const std::vector<std::string>& folders, const std::string& out,
                         bool overwrite, const TrialReport& report) {
  if (isTrialFolder(out) && !overwrite)
    throw ConfigError("merge: '" + out +
                      "' holds a trial already; choose another --out, or --overwrite it");
  Merger<TrialRecord> merger("trial", "run");
  std::map<std::string, std::string> trajectories;  // former path by the one in the new folder
  for (const std::string& folder : folders) {
    TrialRecord part = readTrial(folder);
    for (const TrialRun& run : part.results) {
      trajectories[groundTruthPath("", run.recording, run.from_s)] =
          groundTruthPath(folder, run.recording, run.from_s);
      if (run.variant.system.empty())
        trajectories[trajectoryPath("", part, run)] = trajectoryPath(folder, part, run);
    }
    merger.add(folder, std::move(part), hasTrialResults(folder));
  }
  TrialOutcome outcome;
  outcome.record = merger.finish();
  makeFolder(out);
  const FolderLock lock(out);
  OutputFiles output(out);
  const std::string folder = output.path("");
  writeTrialHead(folder, outcome.record);
  LineStore store(pathIn(folder, "runs"));
  for (const TrialRun& run : outcome.record.results) store.append(run.recording, resultToText(run));
  for (const auto& [name, former] : trajectories) {
    if (!fs::exists(former)) continue;
    const fs::path copy = fs::path(folder) / name;
    makeFolder(copy.parent_path().string());
    fs::copy_file(former, copy);
  }
  outcome.runs_found = outcome.record.results.size();
  for (const std::string& file : writeTrialResults(folder, outcome.record, report))
    outcome.files.push_back((fs::path(out) / fs::path(file).filename()).string());
  discardTrial(out);
  output.putInPlace();
  return outcome;
}

}  // namespace etalon
