#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/record.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/process/child_process.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** The progress of a benchmark or trial. */
struct BenchmarkProgress {
  enum class Stage { kFrontEnd, kWindows, kRuns };
  Stage stage = Stage::kFrontEnd;
  size_t done = 0;           ///< stereo pairs, windows (all initializers), or runs of a trial
  size_t total = 0;          ///< of this run, without what was on disk already
  double elapsed_s = 0.0;    ///< in this stage
  double remaining_s = 0.0;  ///< at the rate so far
};

struct BenchmarkOptions {
  std::vector<std::string> sources;  ///< EuRoC folders and rawlogs
  /** SourceOptions::ground_truth of one recording, or a folder of them (groundTruthOf()); empty: the
   * recordings' own. */
  std::string ground_truth;
  std::string out;     ///< the benchmark's folder (store.h)
  std::string tracks;  ///< folder of the cached tracks; empty: `out`/tracks
  BenchmarkProtocol protocol;
  int jobs = 1;  ///< threads of the front end, processes of the windows
  /** Processor time that an initializer and the VI-BA may use for a window, s. */
  double time_limit_s = kDefaultTimeLimitS;
  int shard = 1, shards = 1;  ///< part `shard` of `shards`, from 1
  bool overwrite = false;     ///< start again: discard the windows in `out`
  std::map<std::string, std::string> versions;
  BenchmarkReport report;                                  ///< makes report.html; empty: no report
  std::function<void(const BenchmarkProgress&)> progress;  ///< called from one thread at a time
  /** Called with a sentence as soon as an initializer has crashed or used up its time; may be
   * empty. */
  std::function<void(const std::string&)> warn;
  /** Set to true to stop the benchmark; may be null. */
  const std::atomic<bool>* stop = nullptr;
};

struct BenchmarkOutcome {
  BenchmarkRecord record;
  size_t results_found = 0;    ///< results (window and initializer) that were on disk already
  size_t results_tried = 0;    ///< the same for this run
  size_t results_missing = 0;  ///< of the shard: more than 0 only if interrupted
  bool interrupted = false;
  double frontend_s = 0.0, windows_s = 0.0;  ///< wall clock
  std::vector<std::string> files;            ///< results written; empty if interrupted
  std::vector<std::string> notes;            ///< what happened to the cached tracks, in sentences
};

/**
 * The exhaustive initialization test: every window of every recording, for every shape and
 * initializer, is an independent, deterministic problem; the front end runs once a recording. Every
 * finished window is written at once; the same call resumes. Windows are tried in child processes
 * (a fork: call it while the process has one thread): an initializer that crashes, ends the process
 * or uses up its time loses the window, which is recorded as kStatusCrashed or kStatusTimeLimit,
 * and the next one is tried. The results do not depend on `jobs`, on interruptions or shards (run
 * times apart). A recording that cannot be used has its `error` set in the record, and the others
 * go on.
 *
 * @throws ConfigError if `out` holds a benchmark of other code, configuration, data or protocol, or
 *         two recordings have the same name; DataError if results cannot be written
 */
BenchmarkOutcome runBenchmark(const SuiteConfiguration& configuration,
                              const BenchmarkOptions& options);

/**
 * Joins the parts of a benchmark that ran as shards into the folder `out` and writes its results.
 * @throws ConfigError naming the folders and what differs, is missing or is there twice
 */
BenchmarkOutcome mergeBenchmarks(const std::vector<std::string>& folders, const std::string& out,
                                 bool overwrite, const BenchmarkReport& report);

/** Why the windows of two benchmarks cannot be parts of one: how they differ in code,
 * configuration, protocol, initializers or recordings. Empty if they do not differ. */
std::string differenceOf(const BenchmarkRecord& a, const BenchmarkRecord& b);

}  // namespace etalon
