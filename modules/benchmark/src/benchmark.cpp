#include "etalon/benchmark/benchmark.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <set>

#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/store.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"
#include "etalon/core/output_file.h"
#include "etalon/core/stopwatch.h"
#include "etalon/core/text.h"
#include "suite/isolated_work.h"
#include "suite/open_recordings.h"
#include "suite/parallel.h"
#include "suite/progress_report.h"
#include "window_trial.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

/** A window that this run shall try, and which of the initializers. */
struct Task {
  size_t sequence = 0;
  WindowShape shape;
  int window = 0;
  std::vector<size_t> initializers;
};

class Benchmark {
 public:
  Benchmark(const SuiteConfiguration& configuration, const BenchmarkOptions& options)
      : configuration_(configuration),
        options_(options),
        tracks_folder_(options.tracks.empty() ? (fs::path(options.out) / "tracks").string()
                                              : options.tracks),
        store_(options.out) {
    window_options_ = configuration.pipeline.window;
    window_options_.refine = options.protocol.vi_ba;
  }

  BenchmarkOutcome run() {
    describe();
    openRecordings();
    requireWindows();
    makeFolder(options_.out);
    const FolderLock lock(options_.out);
    adoptFormerRun();
    writeBenchmarkHead(options_.out, record_);
    chooseWindows();
    Stopwatch watch;
    runFrontEnd();
    outcome_.frontend_s = 1e-3 * watch.lapMilliseconds();
    if (!stopped()) {
      writeBenchmarkHead(options_.out, record_);
      runWindows();
    }
    outcome_.windows_s = 1e-3 * watch.lapMilliseconds();
    finish();
    return std::move(outcome_);
  }

 private:
  bool stopped() const { return options_.stop && options_.stop->load(); }

  void describe() {
    const std::vector<WindowShape> shapes = shapesOf(options_.protocol);
    for (auto shape = shapes.begin(); shape != shapes.end(); ++shape)
      if (std::find(shapes.begin(), shape, *shape) != shape)
        throw ConfigError(
            format("windows of %d keyframes at %g Hz are asked for twice; expected "
                   "different values of --keyframes and of --rate",
                   shape->keyframes, shape->rate_hz));
    record_.protocol = options_.protocol;
    record_.versions = options_.versions;
    record_.binaries = programHash();
    record_.shard = options_.shard;
    record_.shards = options_.shards;
    record_.config = configuration_.pipeline_ini;
    record_.initializers = initializerRecords(configuration_.initializers);
  }

  void openRecordings() {
    recordings_ =
        etalon::openRecordings(options_.sources, options_.ground_truth, &record_.sequences);
    for (size_t s = 0; s < recordings_.size(); ++s)
      if (recordings_[s])
        checkKeyframeRates(options_.protocol.rates_hz, imageRate(recordings_[s]->imageStamps()),
                           record_.sequences[s].name);
    tracks_.resize(recordings_.size());
  }

  /** @throws ConfigError if there are recordings, and none is long enough */
  void requireWindows() const {
    bool any_opened = false;
    for (const BenchmarkSequence& sequence : record_.sequences) {
      if (!sequence.error.empty()) continue;
      any_opened = true;
      for (const WindowShape& shape : shapesOf(options_.protocol))
        if (windowCount(sequence.first_image, sequence.last_image, options_.protocol.every_s,
                        shape) > 0)
          return;
    }
    if (any_opened)
      throw ConfigError("no window is left: " + joined(tooShort(record_), "; ") +
                        "; expected longer recordings, fewer --keyframes or a higher --rate");
  }

  /** Finds the windows that an interrupted run of the same benchmark has finished. */
  void adoptFormerRun() {
    if (!isBenchmarkFolder(options_.out)) return;
    if (options_.overwrite) {
      discardBenchmark(options_.out);
      return;
    }
    const BenchmarkRecord former = readBenchmarkHead(options_.out);
    std::string difference = differenceOf(former, record_);
    if (difference.empty() && (former.shard != record_.shard || former.shards != record_.shards))
      difference = "it is another shard";
    if (!difference.empty())
      throw ConfigError("'" + options_.out + "' holds a benchmark that cannot be resumed: " +
                        difference + "; choose another --out, or --overwrite it");
    for (size_t i = 0; i < record_.sequences.size(); ++i)
      record_.sequences[i].content = former.sequences[i].content;
    for (const BenchmarkSequence& sequence : record_.sequences)
      for (WindowResult& result : store_.read(sequence.name)) {
        finished_.insert(resultKey(result));
        record_.results.push_back(std::move(result));
      }
    outcome_.results_found = record_.results.size();
  }

  /** The windows of this shard, in order, less those that are finished. */
  void chooseWindows() {
    std::vector<Task> all;
    for (size_t s = 0; s < recordings_.size(); ++s) {
      if (!recordings_[s]) continue;
      const BenchmarkSequence& sequence = record_.sequences[s];
      for (const WindowShape& shape : shapesOf(options_.protocol)) {
        const int windows = windowCount(sequence.first_image, sequence.last_image,
                                        options_.protocol.every_s, shape);
        for (int window = 0; window < windows; ++window) all.push_back({s, shape, window, {}});
      }
    }
    // A shard is one contiguous piece, so that it needs the tracks of few recordings.
    const size_t shard = options_.shard;
    const size_t shards = options_.shards;
    const size_t begin = all.size() * (shard - 1) / shards;
    const size_t end = all.size() * shard / shards;
    for (size_t i = begin; i < end; ++i) {
      Task task = all[i];
      needed_.insert(task.sequence);
      for (size_t k = 0; k < configuration_.initializers.size(); ++k)
        if (finished_.count(resultKey(emptyResult(task, k))) == 0) task.initializers.push_back(k);
      if (!task.initializers.empty()) tasks_.push_back(std::move(task));
    }
  }

  WindowResult emptyResult(const Task& task, size_t initializer) const {
    WindowResult result;
    result.sequence = record_.sequences[task.sequence].name;
    result.window = task.window;
    result.keyframes = task.shape.keyframes;
    result.rate_hz = task.shape.rate_hz;
    result.initializer = configuration_.initializers[initializer].plugin.name;
    return result;
  }

  void runFrontEnd() {
    std::vector<size_t> order(needed_.begin(), needed_.end());
    // The longest recordings come first, so that the threads end together.
    std::stable_sort(order.begin(), order.end(), [this](size_t a, size_t b) {
      return record_.sequences[a].stereo_frames > record_.sequences[b].stereo_frames;
    });
    size_t pairs = 0;
    for (const size_t s : order) pairs += recordings_[s]->imageStamps().size();
    ProgressReport progress(options_.progress, BenchmarkProgress::Stage::kFrontEnd, pairs);
    inParallel(options_.jobs, order.size(), [&](size_t i) {
      if (!stopped()) prepare(order[i], &progress);
    });
  }

  /** Gets the tracks of a recording, from the cache where it can be trusted. */
  void prepare(size_t s, ProgressReport* progress) {
    BenchmarkSequence& sequence = record_.sequences[s];
    RecordedSource& recording = *recordings_[s];
    try {
      const std::string content = contentOf(recording);
      if (!sequence.content.empty() && sequence.content != content)
        throw ConfigError("'" + options_.out + "' has windows of '" + sequence.name +
                          "', but the recording or its ground truth has changed since; choose "
                          "another --out, or --overwrite it");
      sequence.content = content;
      tracks_[s] = std::make_unique<SequenceTracks>(tracksOf(sequence, &recording, progress));
    } catch (const Interrupted&) {
      return;
    } catch (const DataError& e) {
      sequence.error = e.what();
      return;
    }
    sequence.unreadable_images = tracks_[s]->unreadable_images;
    sequence.frontend_ms = tracks_[s]->frontend_ms;
    if (sequence.has_ground_truth) {
      const GroundTruth& truth = tracks_[s]->ground_truth;
      const std::vector<ImuSample> imu = recording.imuMeasurements();
      sequence.ground_truth_check = checkGroundTruth(truth, imu);
      sequence.gyro_agreement = gyroAgreement(truth, imu, sequence.ground_truth_check.bias.gyro,
                                              recording.calibration().imu.noise.gyro_noise_density);
    }
    recordings_[s].reset();
  }

  SequenceTracks tracksOf(const BenchmarkSequence& sequence, RecordedSource* recording,
                          ProgressReport* progress) {
    TrackingOptions tracking = trackingOptions(configuration_.pipeline);
    tracking.decode_ahead = options_.jobs > 1;
    tracking.stop = options_.stop;
    size_t tracked = 0;
    tracking.progress = [progress, &tracked](size_t, size_t) {
      progress->add(1);
      ++tracked;
    };
    std::string sentence;
    SequenceTracks tracks = loadOrTrack(*recording, recordingHash(*recording), sequence.name,
                                        tracks_folder_, tracking, &sentence);
    if (tracked == 0) progress->add(recording->imageStamps().size());
    if (!sentence.empty()) note(sentence);
    return tracks;
  }

  void note(const std::string& sentence) {
    const std::lock_guard<std::mutex> lock(mutex_);
    outcome_.notes.push_back(sentence);
  }

  void runWindows() {
    tasks_.erase(std::remove_if(tasks_.begin(), tasks_.end(),
                                [this](const Task& task) { return !tracks_[task.sequence]; }),
                 tasks_.end());
    ProgressReport progress(options_.progress, BenchmarkProgress::Stage::kWindows, tasks_.size());
    IsolatedWork work;
    work.items = tasks_.size();
    work.parts = [this](size_t i) { return tasks_[i].initializers.size(); };
    work.run = [this](size_t i, size_t first, const DoPart& do_part) {
      const WindowTrial trial = trialOf(tasks_[i]);
      for (size_t part = first; part < tasks_[i].initializers.size(); ++part)
        do_part(part, [&] { return resultToText(trial.tryWith(initializerOf(i, part))); });
    };
    work.finished = [this](size_t i, size_t, const std::string& text) {
      store_.append(record_.sequences[tasks_[i].sequence].name, text);
      keep(resultFromText(text));
    };
    work.died = [this](size_t i, size_t part, const std::string& how, bool out_of_time) {
      WindowResult result = trialOf(tasks_[i]).lost(
          initializerOf(i, part).plugin.name, out_of_time ? kStatusTimeLimit : kStatusCrashed, how);
      if (options_.warn) options_.warn(resultKey(result) + ": " + how);
      store_.append(result);
      keep(std::move(result));
    };
    work.item_done = [&progress](size_t) { progress.add(1); };
    work.stopped = [this] { return stopped(); };
    runIsolatedWork(options_.jobs, options_.time_limit_s, work);
  }

  const ConfiguredInitializer& initializerOf(size_t task, size_t part) const {
    return configuration_.initializers[tasks_[task].initializers[part]];
  }

  WindowTrial trialOf(const Task& task) const {
    return {emptyResult(task, 0),
            *tracks_[task.sequence],
            record_.sequences[task.sequence].ground_truth_check,
            options_.protocol,
            configuration_.pipeline.imu_noise,
            window_options_};
  }

  void keep(WindowResult result) {
    record_.results.push_back(std::move(result));
    ++outcome_.results_tried;
  }

  void finish() {
    size_t missing = 0;
    for (const Task& task : tasks_) missing += task.initializers.size();
    outcome_.results_missing = missing - outcome_.results_tried;
    outcome_.interrupted = stopped() && outcome_.results_missing > 0;
    sortResults(&record_);
    requireCoverage(&record_);  // what is stored keeps all errors
    writeBenchmarkHead(options_.out, record_);
    if (!outcome_.interrupted)
      outcome_.files = writeBenchmarkResults(options_.out, record_, options_.report);
    outcome_.record = std::move(record_);
  }

  const SuiteConfiguration& configuration_;
  const BenchmarkOptions& options_;
  std::string tracks_folder_;
  WindowOptions window_options_;
  ResultStore store_;
  BenchmarkRecord record_;
  BenchmarkOutcome outcome_;
  std::vector<std::unique_ptr<RecordedSource>> recordings_;  ///< null where it cannot be read
  std::vector<std::unique_ptr<SequenceTracks>> tracks_;      ///< null where there are none
  std::set<std::string> finished_;                           ///< resultKey()s
  std::set<size_t> needed_;                                  ///< sequences of this shard
  std::vector<Task> tasks_;
  std::mutex mutex_;  ///< of outcome_ while threads run
};

}  // namespace

BenchmarkOutcome runBenchmark(const SuiteConfiguration& configuration,
                              const BenchmarkOptions& options) {
  return Benchmark(configuration, options).run();
}

}  // namespace etalon
