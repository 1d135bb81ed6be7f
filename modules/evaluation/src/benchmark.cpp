#include "etalon/evaluation/benchmark.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <set>

#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"
#include "etalon/datasets/recording_checks.h"
#include "etalon/evaluation/attempt_record.h"
#include "etalon/evaluation/benchmark_slots.h"
#include "etalon/evaluation/benchmark_store.h"
#include "etalon/evaluation/content_hash.h"
#include "etalon/evaluation/ground_truth_coverage.h"
#include "etalon/evaluation/sequence_tracks.h"
#include "files.h"
#include "folder_lock.h"
#include "parallel.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

/** A slot that this run shall try, and which of the initializers. */
struct Task {
  size_t sequence = 0;
  BenchmarkWindow window;
  int segment = 0;
  std::vector<size_t> initializers;
};

/** Calls the caller's progress function, one thread at a time. */
class ProgressReport {
 public:
  ProgressReport(const BenchmarkOptions& options, BenchmarkProgress::Stage stage, size_t total)
      : call_(options.progress) {
    progress_.stage = stage;
    progress_.total = total;
  }

  void add(size_t done) {
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_.done += done;
    progress_.elapsed_s += 1e-3 * watch_.lapMilliseconds();
    if (!call_ || progress_.done == 0) return;
    progress_.remaining_s = progress_.elapsed_s / static_cast<double>(progress_.done) *
                            static_cast<double>(progress_.total - progress_.done);
    call_(progress_);
  }

 private:
  std::function<void(const BenchmarkProgress&)> call_;
  std::mutex mutex_;
  BenchmarkProgress progress_;
  Stopwatch watch_;
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
    makeFolder(options_.out);
    const FolderLock lock(options_.out);
    adoptFormerRun();
    writeBenchmarkHead(options_.out, record_);
    chooseSlots();
    Stopwatch watch;
    runFrontEnd();
    outcome_.frontend_s = 1e-3 * watch.lapMilliseconds();
    if (!stopped()) {
      writeBenchmarkHead(options_.out, record_);
      runSlots();
    }
    outcome_.slots_s = 1e-3 * watch.lapMilliseconds();
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
    record_.config = configuration_.pipeline_ini;
    for (const ConfiguredInitializer& initializer : configuration_.initializers)
      record_.initializers.push_back({initializer.plugin.name, initializer.plugin.version,
                                      initializer.plugin.description,
                                      fileHash(initializer.plugin.path), initializer.ini});
  }

  void openRecordings() {
    std::set<std::string> names;
    for (const std::string& source : options_.sources) {
      BenchmarkSequence sequence;
      sequence.name = recordingName(source);
      if (!names.insert(sequence.name).second)
        throw ConfigError("two recordings are called '" + sequence.name +
                          "'; their folders or files need different names (" + source + ")");
      sequence.source = fs::absolute(source).lexically_normal().string();
      std::unique_ptr<RecordedSource> recording;
      try {
        recording = openRecording(source);
        sequence.source_kind = recording->kind();
        const std::vector<TimeNs>& stamps = recording->imageStamps();
        checkLength(source, stamps.front(), stamps.back());
        sequence.first_image = stamps.front();
        sequence.last_image = stamps.back();
        sequence.duration_s = secondsBetween(sequence.first_image, sequence.last_image);
        sequence.stereo_frames = static_cast<int>(recording->imageStamps().size());
        sequence.has_ground_truth = !recording->groundTruth().empty();
        sequence.warnings = recording->statistics().warnings;
        for (std::string& warning : requireSoundRecording(source))
          sequence.warnings.push_back(std::move(warning));
      } catch (const DataError& e) {
        sequence.error = e.what();
        recording.reset();
      }
      if (recording)
        checkKeyframeRates(options_.protocol.rates_hz, imageRate(recording->imageStamps()),
                           sequence.name);
      record_.sequences.push_back(std::move(sequence));
      recordings_.push_back(std::move(recording));
    }
    tracks_.resize(recordings_.size());
  }

  /** Finds the slots that an interrupted run of the same benchmark has finished. */
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
      for (SlotRecord& slot : store_.read(sequence.name)) {
        finished_.insert(slotKey(slot));
        record_.slots.push_back(std::move(slot));
      }
    outcome_.slots_found = record_.slots.size();
  }

  /** The slots of this shard, in order, less those that are finished. */
  void chooseSlots() {
    std::vector<Task> all;
    for (size_t s = 0; s < recordings_.size(); ++s) {
      if (!recordings_[s]) continue;
      const BenchmarkSequence& sequence = record_.sequences[s];
      for (const BenchmarkWindow& window : windowsOf(options_.protocol)) {
        const int slots =
            slotCount(sequence.first_image, sequence.last_image, options_.protocol.every_s, window);
        for (int segment = 0; segment < slots; ++segment) all.push_back({s, window, segment, {}});
      }
    }
    // In one piece: a shard needs the tracks of few recordings.
    const auto shard = static_cast<size_t>(options_.shard);
    const auto shards = static_cast<size_t>(options_.shards);
    const size_t begin = all.size() * (shard - 1) / shards;
    const size_t end = all.size() * shard / shards;
    for (size_t i = begin; i < end; ++i) {
      Task task = all[i];
      needed_.insert(task.sequence);
      for (size_t k = 0; k < configuration_.initializers.size(); ++k)
        if (finished_.count(slotKey(emptySlot(task, k))) == 0) task.initializers.push_back(k);
      if (!task.initializers.empty()) tasks_.push_back(std::move(task));
    }
  }

  SlotRecord emptySlot(const Task& task, size_t initializer) const {
    SlotRecord slot;
    slot.sequence = record_.sequences[task.sequence].name;
    slot.segment = task.segment;
    slot.keyframes = task.window.keyframes;
    slot.rate_hz = task.window.rate_hz;
    slot.initializer = configuration_.initializers[initializer].plugin.name;
    return slot;
  }

  void runFrontEnd() {
    std::vector<size_t> order(needed_.begin(), needed_.end());
    // The longest first, so that the threads end together.
    std::stable_sort(order.begin(), order.end(), [this](size_t a, size_t b) {
      return record_.sequences[a].stereo_frames > record_.sequences[b].stereo_frames;
    });
    size_t pairs = 0;
    for (const size_t s : order) pairs += recordings_[s]->imageStamps().size();
    ProgressReport progress(options_, BenchmarkProgress::Stage::kFrontEnd, pairs);
    inParallel(options_.jobs, order.size(), [&](size_t i) {
      if (!stopped()) prepare(order[i], &progress);
    });
  }

  /** Tracks of a recording, from the cache where that can be trusted. */
  void prepare(size_t s, ProgressReport* progress) {
    BenchmarkSequence& sequence = record_.sequences[s];
    RecordedSource& recording = *recordings_[s];
    try {
      const std::string content = recordingHash(recording);
      if (!sequence.content.empty() && sequence.content != content)
        throw ConfigError("'" + options_.out + "' has slots of '" + sequence.name +
                          "', but the recording has changed since; choose another --out, or "
                          "--overwrite it");
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
    if (sequence.has_ground_truth)
      sequence.floor = groundTruthFloor(tracks_[s]->ground_truth, recording.imuSamples());
    recordings_[s].reset();
  }

  SequenceTracks tracksOf(const BenchmarkSequence& sequence, RecordedSource* recording,
                          ProgressReport* progress) {
    TrackingOptions tracking;
    tracking.frontend = configuration_.pipeline.frontend;
    tracking.gyro_bias = configuration_.pipeline.window.priors.mean.gyro;
    tracking.decode_ahead = options_.jobs > 1;
    tracking.stop = options_.stop;
    size_t tracked = 0;
    tracking.progress = [progress, &tracked](size_t, size_t) {
      progress->add(1);
      ++tracked;
    };
    std::string sentence;
    SequenceTracks tracks = loadOrTrack(*recording, sequence.content, sequence.name, tracks_folder_,
                                        tracking, &sentence);
    if (tracked == 0) progress->add(recording->imageStamps().size());
    if (!sentence.empty()) note(sentence);
    return tracks;
  }

  void note(const std::string& sentence) {
    const std::lock_guard<std::mutex> lock(mutex_);
    outcome_.notes.push_back(sentence);
  }

  void runSlots() {
    tasks_.erase(std::remove_if(tasks_.begin(), tasks_.end(),
                                [this](const Task& task) { return !tracks_[task.sequence]; }),
                 tasks_.end());
    ProgressReport progress(options_, BenchmarkProgress::Stage::kSlots, tasks_.size());
    const ImuNoiseOptions& factors = configuration_.pipeline.imu_noise;
    inParallel(options_.jobs, tasks_.size(), [&](size_t i) {
      if (stopped()) return;
      const Task& task = tasks_[i];
      const SequenceTracks& tracks = *tracks_[task.sequence];
      const InitializationProblem problem =
          slotProblem(tracks, options_.protocol.every_s, task.window, task.segment,
                      factors.apply(tracks.calibration.imu.noise), window_options_);
      std::vector<TimeNs> keyframes;
      for (int k = 0; k < problem.keyframeCount(); ++k) keyframes.push_back(problem.keyframe(k).t);
      const double gyro_rre_deg = gyroWindowRreDeg(tracks.ground_truth, tracks.imu, keyframes);
      for (const size_t k : task.initializers) {
        SlotRecord slot = trySlot(task, k, problem);
        slot.gyro_rre_deg = gyro_rre_deg;
        keep(std::move(slot));
      }
      progress.add(1);
    });
  }

  SlotRecord trySlot(const Task& task, size_t k, const InitializationProblem& problem) const {
    SlotRecord slot = emptySlot(task, k);
    const GroundTruth& truth = tracks_[task.sequence]->ground_truth;
    const InitializationAttempt attempt = attemptInitialization(
        problem, *configuration_.initializers[k].initializer, window_options_);
    slot.attempt =
        makeAttemptRecord(attempt, window_options_.gravity_mps2, truth,
                          record_.sequences[task.sequence].floor.foundGravityDirection());
    for (StageRecord& stage : slot.attempt.stages) {
      stage.covariance.resize(0, 0);
      stage.covariance_order.clear();
    }
    if (problem.keyframeCount() > 0) slot.t0 = problem.keyframe(0).t;
    for (int i = 0; i < problem.keyframeCount(); ++i)
      if (const auto state = truth.at(problem.keyframe(i).t)) slot.truth.push_back(*state);
    if (attempt.has_vi_ba && attempt.vi_ba.noise.gyro.dof > 0.0) slot.noise = attempt.vi_ba.noise;
    return slot;
  }

  void keep(SlotRecord slot) {
    store_.append(slot);
    const std::lock_guard<std::mutex> lock(mutex_);
    record_.slots.push_back(std::move(slot));
    ++outcome_.slots_tried;
  }

  void finish() {
    size_t missing = 0;
    for (const Task& task : tasks_) missing += task.initializers.size();
    outcome_.slots_missing = missing - outcome_.slots_tried;
    outcome_.interrupted = stopped() && outcome_.slots_missing > 0;
    sortSlots(&record_);
    requireCoverage(&record_, options_.min_coverage);  // what is stored keeps all errors
    writeBenchmarkHead(options_.out, record_);
    if (!outcome_.interrupted) outcome_.files = writeBenchmarkResults(options_.out, record_);
    outcome_.record = std::move(record_);
  }

  const SuiteConfiguration& configuration_;
  const BenchmarkOptions& options_;
  std::string tracks_folder_;
  WindowOptions window_options_;
  SlotStore store_;
  BenchmarkRecord record_;
  BenchmarkOutcome outcome_;
  std::vector<std::unique_ptr<RecordedSource>> recordings_;  ///< null where it cannot be read
  std::vector<std::unique_ptr<SequenceTracks>> tracks_;      ///< null where there are none
  std::set<std::string> finished_;                           ///< slotKey()s
  std::set<size_t> needed_;                                  ///< sequences of this shard
  std::vector<Task> tasks_;
  std::mutex mutex_;  ///< of record_.slots and outcome_ while threads run
};

}  // namespace

BenchmarkOutcome runBenchmark(const SuiteConfiguration& configuration,
                              const BenchmarkOptions& options) {
  return Benchmark(configuration, options).run();
}

}  // namespace etalon
