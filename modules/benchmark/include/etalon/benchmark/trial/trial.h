#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/simulation/faults/fault_scenario.h"

namespace etalon {

/** A configuration of the pipeline, with the initializers to try; the same ones in every setting. */
struct TrialSetting {
  std::string name;  ///< may be empty if there is but one
  SuiteConfiguration configuration;
};

/** Processor time that a run may use, s: far from what one takes. */
constexpr double kTrialTimeLimitS = 600.0;

struct TrialOptions {
  std::vector<std::string> sources;  ///< recordings
  /** SourceOptions::ground_truth of one recording, or a folder of them (groundTruthOf()); empty: the
   * recordings' own. */
  std::string ground_truth;
  std::string out;  ///< the trial's folder (trial_store.h)
  TrialProtocol protocol;
  std::vector<std::string> odometries;  ///< [odometry] kind; empty: that of the first setting
  std::vector<FaultScenario> faults;    ///< kNoFault is added at the front where it is missing
  /** Other systems: name, and folder of their trajectories (trajectoryName()). */
  std::vector<NamedText> systems;
  int jobs = 1;                            ///< processes
  double time_limit_s = kTrialTimeLimitS;  ///< processor time of a run
  int shard = 1, shards = 1;               ///< part `shard` of `shards`, from 1
  bool overwrite = false;                  ///< start again: discard the runs in `out`
  std::map<std::string, std::string> versions;
  TrialReport report;                                      ///< makes report.html; empty: none
  std::function<void(const BenchmarkProgress&)> progress;  ///< called from one thread at a time
  /** Called with a sentence as soon as a run has crashed or used up its time; may be empty. */
  std::function<void(const std::string&)> warn;
  const std::atomic<bool>* stop = nullptr;  ///< set to true to stop; may be null
  /** Called once it is seen to stop, while the runs in progress are finished; may be empty. */
  std::function<void()> stopping;
};

struct TrialOutcome {
  TrialRecord record;
  size_t runs_found = 0;  ///< that were on disk already
  size_t runs_made = 0;
  size_t runs_missing = 0;  ///< of the shard: more than 0 only if interrupted
  bool interrupted = false;
  double wall_s = 0.0;
  std::vector<std::string> files;  ///< results written; empty if interrupted
};

/**
 * Flies parts of recordings with every setting, odometry and initializer, without a fault and with
 * each of the faults. A run depends on the recording, the configuration, the program and the seed
 * alone, not on `jobs`, interruptions or shards (times apart). Every finished run is written at
 * once; the same call resumes.
 *
 * Runs are made in child processes (a fork: call it while the process has one thread), each in one
 * of its own: one that crashes or uses up its time is recorded as kStatusCrashed or
 * kStatusTimeLimit, and the next one is made. The images of a part are decoded once a process, and
 * what comes before a fault is flown once: the process forks where the fault begins.
 *
 * @throws ConfigError if `out` holds a trial of other code, configuration, data or protocol, or
 *         names are there twice; DataError if results cannot be written
 */
TrialOutcome runTrial(const std::vector<TrialSetting>& settings, const TrialOptions& options);

/** Joins the parts of a trial that ran as shards into the folder `out` and writes its results.
 * @throws ConfigError naming the folders and what differs, is missing or is there twice */
TrialOutcome mergeTrials(const std::vector<std::string>& folders, const std::string& out,
                         bool overwrite, const TrialReport& report);

}  // namespace etalon
