#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "etalon/benchmark/trial/trial.h"
#include "etalon/core/process/isolated_run.h"
#include "suite/isolated_work.h"
#include "trial/trial_cut.h"
#include "trial/trial_flight.h"

namespace etalon {

/** What a process does in one go: one variant over one part of a recording, with some faults. */
struct TrialTask {
  size_t sequence = 0;
  double from_s = 0.0;
  size_t cut = 0;  ///< tasks of the same sequence and instant have the same number
  TrialVariant variant;
  std::vector<size_t> faults;  ///< indices of TrialOptions::faults
};

/** Makes runs, in a process of its own. Keeps the last part of a recording in memory. */
class TrialWorker {
 public:
  /** All arguments must outlive it. @param options with all faults, kNoFault first */
  TrialWorker(const std::vector<TrialSetting>& settings, const TrialOptions& options,
              const TrialRecord& record)
      : settings_(settings), options_(options), record_(record) {}

  /** Makes the runs of a task, each a part whose answer is resultToText(), in an order that depends
   * on the task alone; parts before `first` are left out. */
  void run(const TrialTask& task, size_t first, const DoPart& do_part);

 private:
  struct FaultyRun {
    size_t fault = 0;
    FaultyCut cut;  ///< without a fault only `same` is filled in
  };

  const TrialCut& cutOf(const TrialTask& task);
  std::vector<FaultyRun> inOrder(const TrialTask& task, const TrialCut& cut) const;
  IsolatedOutcome flyTogether(const TrialTask& task, const TrialCut& cut,
                              std::vector<FaultyRun>* runs, size_t first,
                              const TextSink& told) const;
  TrialRun flyAlone(const TrialTask& task, const TrialCut& cut, const FaultyRun& faulty) const;
  TrialRun flyOn(const TrialTask& task, FaultyRun* faulty, TrialFlight* trunk) const;
  TrialRun isolated(TrialRun run, const std::function<TrialRun(TrialRun)>& function) const;
  IsolationLimits limits() const;
  TrialRun end(TrialRun run, TrialFlight* flight, const FaultyRun& faulty,
               const SensorSource& source) const;
  void writeTruth(const TrialRun& run, const std::vector<TimeNs>& images,
                  const GroundTruth& truth) const;
  TrialRun judgeSystem(const TrialTask& task, const TrialCut& cut, FaultyRun* faulty) const;
  TrialRun emptyRun(const TrialTask& task, size_t fault) const;
  std::unique_ptr<TrialFlight> flightOf(const TrialTask& task, const SensorSource& source) const;

  const std::vector<TrialSetting>& settings_;
  const TrialOptions& options_;
  const TrialRecord& record_;
  std::optional<TrialCut> cut_;
  size_t cut_of_ = 0;  ///< TrialTask::cut of cut_
  int images_ = 0;     ///< of cut_
};

}  // namespace etalon
