#pragma once

#include <functional>
#include <string>
#include <vector>

#include "etalon/benchmark/summary.h"
#include "etalon/benchmark/trial/trial_record.h"

namespace etalon {

/** What some runs of a trial were worth. Figures are over the runs that have them. */
struct TrialSummary {
  int runs = 0, survived = 0, silent = 0;  ///< of those TrialRun::judged()
  int not_judged = 0, not_met = 0;         ///< the others, by status
  int faulty = 0;                          ///< runs in which a fault changed something
  int reported = 0;                        ///< of these, with an event since the fault
  double coverage = WindowErrors::kNone;   ///< poses of all runs over their frames
  FigureSummary causal_ate_m, smoothed_ate_m, causal_rpe_m, smoothed_rpe_m;
  FigureSummary error_over_predicted, started_s, frame_ms;
  /** Of faulty runs: causal ATE less that of the same run without the fault. */
  FigureSummary added_ate_m;
  double largest_added_ate_m = WindowErrors::kNone;
};

using WhichRuns = std::function<bool(const TrialRun&)>;

TrialSummary summaryOf(const TrialRecord& record, const WhichRuns& which);

/** Why runs do not count, a sentence a recording without ground truth enough and a fault that was
 * not met. */
std::vector<std::string> describeUncounted(const TrialRecord& record);

/** A figure of ErrorsAfterStart over the runs without a fault of a variant. */
FigureSummary afterStart(const TrialRecord& record, const TrialVariant& variant, double after_s,
                         double ErrorsAfterStart::*figure);

/** How often something made runs fail: reasons that differ in numbers or names alone
 * are one; the most frequent first. */
struct FailureKind {
  std::string reason;        ///< of the first such run, whole
  std::vector<size_t> runs;  ///< indices of TrialRecord::results
};
std::vector<FailureKind> failuresOf(const TrialRecord& record);

}  // namespace etalon
