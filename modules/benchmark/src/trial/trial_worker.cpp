#include "trial/trial_worker.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/datasets/ground_truth_file.h"

namespace etalon {
namespace {

/** Delivers all that is left of a source. */
void feedAll(SensorSource* source, TrialFlight* flight) {
  while (auto event = source->next()) flight->feed(std::move(*event));
}

TrialRun brokenOff(TrialRun run, const IsolatedOutcome& outcome) {
  run.status = outcome.out_of_time ? kStatusTimeLimit : kStatusCrashed;
  run.reason = outcome.failure;
  return run;
}

}  // namespace

void TrialWorker::run(const TrialTask& task, size_t first, const DoPart& do_part) {
  size_t part = first;
  const TextSink answer = [&](const std::string& text) { do_part(part++, [&] { return text; }); };
  const TrialCut* cut = nullptr;
  std::vector<FaultyRun> runs;
  try {
    cut = &cutOf(task);
    runs = inOrder(task, *cut);
  } catch (const DataError& e) {  // of the recording: the task has no result but this
    while (part < task.faults.size()) {
      TrialRun run = emptyRun(task, task.faults[part]);
      run.status = kStatusFailed;
      run.reason = e.what();
      answer(resultToText(run));
    }
    return;
  }
  if (!task.variant.system.empty()) {
    while (part < runs.size()) answer(resultToText(judgeSystem(task, *cut, &runs[part])));
    return;
  }
  while (part < runs.size() && runs[part].cut.same == 0)
    answer(resultToText(flyAlone(task, *cut, runs[part])));
  const IsolatedOutcome together = flyTogether(task, *cut, &runs, part, answer);
  // What the runs share has crashed: that was the run without a fault. The others fly alone.
  while (part < runs.size())
    answer(resultToText(runs[part].fault == 0 ? brokenOff(emptyRun(task, 0), together)
                                              : flyAlone(task, *cut, runs[part])));
}

const TrialCut& TrialWorker::cutOf(const TrialTask& task) {
  if (cut_ && cut_of_ == task.cut) return *cut_;
  cut_.reset();  // not two at a time
  images_ = 0;
  const BenchmarkSequence& sequence = record_.sequences[task.sequence];
  const TimeNs from = sequence.first_image + durationNs(task.from_s);
  cut_.emplace(sequence.source, task.from_s, options_.protocol.seconds, TrialCut::kMostBytes,
               groundTruthOf(sequence.name, options_.ground_truth));
  cut_of_ = task.cut;
  const std::unique_ptr<SensorSource> source = cut_->open();
  const std::vector<TimeNs>& stamps = source->imageStamps();
  const TimeNs to = options_.protocol.seconds > 0.0 ? from + durationNs(options_.protocol.seconds)
                                                    : sequence.last_image;
  images_ = static_cast<int>(
      std::count_if(stamps.begin(), stamps.end(), [=](TimeNs t) { return from <= t && t <= to; }));
  return *cut_;
}

/** As far as they share with the run without a fault, and that one last. */
std::vector<TrialWorker::FaultyRun> TrialWorker::inOrder(const TrialTask& task,
                                                         const TrialCut& cut) const {
  std::vector<FaultyRun> runs;
  for (const size_t fault : task.faults) {
    FaultyRun run{fault, {}};
    if (fault > 0)
      run.cut = faultyCut(cut, options_.faults[fault], options_.protocol.seed);
    else
      run.cut.same = std::numeric_limits<size_t>::max();
    runs.push_back(std::move(run));
  }
  std::stable_sort(runs.begin(), runs.end(),
                   [](const FaultyRun& a, const FaultyRun& b) { return a.cut.same < b.cut.same; });
  return runs;
}

/** Flies the runs from `first` on in one process, which forks where a fault begins and tells the
 * result of every run. */
IsolatedOutcome TrialWorker::flyTogether(const TrialTask& task, const TrialCut& cut,
                                         std::vector<FaultyRun>* runs, size_t first,
                                         const TextSink& told) const {
  if (first == runs->size()) return {};
  IsolationLimits trunk_limits = limits();
  trunk_limits.clock_s *= static_cast<double>(runs->size() - first);  // it waits for the others
  const auto fly = [&](const TextSink& tell) {
    const std::unique_ptr<SensorSource> plain = cut.open();
    const std::unique_ptr<TrialFlight> trunk = flightOf(task, *plain);
    size_t fed = 0;
    for (size_t i = first; i < runs->size(); ++i) {
      FaultyRun& faulty = (*runs)[i];
      for (; fed < faulty.cut.same; ++fed) {
        auto event = plain->next();
        if (!event) break;
        trunk->feed(std::move(*event));
      }
      tell(resultToText(faulty.fault == 0 ? end(emptyRun(task, 0), trunk.get(), faulty, *plain)
                                          : flyOn(task, &faulty, trunk.get())));
    }
    return std::string();
  };
  return runIsolated(fly, trunk_limits, told);
}

/** From the beginning to the end. */
TrialRun TrialWorker::flyAlone(const TrialTask& task, const TrialCut& cut,
                               const FaultyRun& faulty) const {
  return isolated(emptyRun(task, faulty.fault), [&](TrialRun run) {
    const std::unique_ptr<SensorSource> source =
        withFaults(cut.open(), options_.faults[faulty.fault], cut.fromS(),
                   static_cast<std::uint64_t>(options_.protocol.seed));
    const std::unique_ptr<TrialFlight> flight = flightOf(task, *source);
    feedAll(source.get(), flight.get());
    return end(std::move(run), flight.get(), faulty, *source);
  });
}

/** From where the fault begins, in a copy of the process that has come so far. */
TrialRun TrialWorker::flyOn(const TrialTask& task, FaultyRun* faulty, TrialFlight* trunk) const {
  return isolated(emptyRun(task, faulty->fault), [&](TrialRun run) {
    if (faulty->cut.first) trunk->feed(*faulty->cut.first);
    feedAll(faulty->cut.source.get(), trunk);
    return end(std::move(run), trunk, *faulty, *faulty->cut.source);
  });
}

IsolationLimits TrialWorker::limits() const {
  IsolationLimits limits;
  limits.cpu_s = options_.time_limit_s;
  limits.clock_s = 60.0 * options_.time_limit_s;  // for what waits; a busy machine ends no run
  limits.memory_gib = 4.0;
  return limits;
}

TrialRun TrialWorker::isolated(TrialRun run,
                               const std::function<TrialRun(TrialRun)>& function) const {
  const IsolatedOutcome outcome =
      runIsolated([&] { return resultToText(function(run)); }, limits());
  return outcome.completed ? trialRunFromText(outcome.output) : brokenOff(std::move(run), outcome);
}

TrialRun TrialWorker::end(TrialRun run, TrialFlight* flight, const FaultyRun& faulty,
                          const SensorSource& source) const {
  Flown flown = flight->finish();
  flown.fault_at = faulty.cut.changed_at;
  judge(flown, source.groundTruth(), options_.protocol, &run);
  if (faulty.fault > 0 && !faulty.cut.changed_at) setFaultNotMet(&run);
  writeTum(trajectoryPath(options_.out, record_, run), flown.causal);
  if (faulty.fault == 0) writeTruth(run, flown.images, source.groundTruth());
  return run;
}

void TrialWorker::writeTruth(const TrialRun& run, const std::vector<TimeNs>& images,
                             const GroundTruth& truth) const {
  Trajectory at_images;
  for (const TimeNs t : images)
    if (const auto state = truth.at(t)) at_images.push_back({t, state->T_WB});
  if (!at_images.empty())
    writeTum(groundTruthPath(options_.out, run.recording, run.from_s), at_images, "T_GB");
}

TrialRun TrialWorker::judgeSystem(const TrialTask& task, const TrialCut& cut,
                                  FaultyRun* faulty) const {
  TrialRun run = emptyRun(task, faulty->fault);
  std::vector<TimeNs> images;
  const std::unique_ptr<SensorSource> source =
      faulty->fault == 0 ? cut.open()
                         : withFaults(cut.open(), options_.faults[faulty->fault], cut.fromS(),
                                      static_cast<std::uint64_t>(options_.protocol.seed));
  while (const auto event = source->next())
    if (std::holds_alternative<StereoFrame>(*event)) images.push_back(stampOf(*event));
  const std::string file = trajectoryPath(options_.out, record_, run);
  run.status = kStatusFailed;
  run.frames = static_cast<int>(images.size());
  if (faulty->fault > 0 && !faulty->cut.changed_at) {
    setFaultNotMet(&run);
    return run;
  }
  if (!std::filesystem::exists(file)) {
    run.reason = "there is no trajectory '" + std::filesystem::path(file).filename().string() + "'";
    return run;
  }
  try {
    const Flown flown = flownBySystem(readTum(file), images, faulty->cut.changed_at);
    judge(flown, source->groundTruth(), options_.protocol, &run);
  } catch (const DataError& e) {
    run.reason = e.what();
  }
  return run;
}

TrialRun TrialWorker::emptyRun(const TrialTask& task, size_t fault) const {
  TrialRun run;
  run.recording = record_.sequences[task.sequence].name;
  run.from_s = task.from_s;
  run.variant = task.variant;
  run.fault = options_.faults[fault].name;
  run.images = run.frames = images_;  // until the run tells how many were delivered
  return run;
}

std::unique_ptr<TrialFlight> TrialWorker::flightOf(const TrialTask& task,
                                                   const SensorSource& source) const {
  const auto setting = std::find_if(settings_.begin(), settings_.end(), [&](const TrialSetting& s) {
    return s.name == task.variant.setting;
  });
  const std::vector<ConfiguredInitializer>& all = setting->configuration.initializers;
  const auto chosen = std::find_if(all.begin(), all.end(), [&](const ConfiguredInitializer& i) {
    return i.plugin.name == task.variant.initializer;
  });
  PipelineOptions options = setting->configuration.pipeline;
  options.initializer = task.variant.initializer;
  options.odometry_kind = task.variant.odometry;
  PipelineInitializers initializers;
  initializers.name = chosen->plugin.name;
  initializers.initializer = chosen->initializer;
  return std::make_unique<TrialFlight>(source.calibration(), options, initializers);
}

}  // namespace etalon
