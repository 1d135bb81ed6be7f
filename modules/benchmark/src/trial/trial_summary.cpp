#include "etalon/benchmark/trial/trial_summary.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

/** The ATE of the runs without a fault, by the key of the run. */
std::map<std::string, double> plainAtes(const TrialRecord& record) {
  std::map<std::string, double> ates;
  for (const TrialRun& run : record.results)
    if (run.fault == kNoFault) ates[resultKey(run)] = run.causal.ate_m;
  return ates;
}

double addedAte(const TrialRun& run, const std::map<std::string, double>& plain) {
  TrialRun without = run;
  without.fault = kNoFault;
  const auto found = plain.find(resultKey(without));
  return found == plain.end() ? WindowErrors::kNone : run.causal.ate_m - found->second;
}

}  // namespace

TrialSummary summaryOf(const TrialRecord& record, const WhichRuns& which) {
  const std::map<std::string, double> plain = plainAtes(record);
  TrialSummary summary;
  long frames = 0, poses = 0;
  std::vector<double> causal, smoothed, causal_rpe, smoothed_rpe, ratio, started, ms, added;
  for (const TrialRun& run : record.results) {
    if (!which(run)) continue;
    if (run.status == kStatusFaultNotMet) {
      ++summary.not_met;
      continue;
    }
    ++(run.judged() ? summary.runs : summary.not_judged);
    summary.survived += run.survived() ? 1 : 0;
    summary.silent += run.silent ? 1 : 0;
    frames += run.frames;
    poses += run.poses;
    causal.push_back(run.causal.ate_m);
    smoothed.push_back(run.smoothed.ate_m);
    causal_rpe.push_back(run.causal.rpe_m);
    smoothed_rpe.push_back(run.smoothed.rpe_m);
    ratio.push_back(run.error_over_predicted);
    started.push_back(run.started_s);
    ms.push_back(run.frame_ms);
    if (!std::isfinite(run.fault_at_s)) continue;
    ++summary.faulty;
    summary.reported += run.event.empty() ? 0 : 1;
    added.push_back(addedAte(run, plain));
    if (std::isfinite(added.back()) && !(added.back() <= summary.largest_added_ate_m))
      summary.largest_added_ate_m = added.back();
  }
  if (frames > 0) summary.coverage = static_cast<double>(poses) / static_cast<double>(frames);
  summary.causal_ate_m = summaryOf(causal);
  summary.smoothed_ate_m = summaryOf(smoothed);
  summary.causal_rpe_m = summaryOf(causal_rpe);
  summary.smoothed_rpe_m = summaryOf(smoothed_rpe);
  summary.error_over_predicted = summaryOf(ratio);
  summary.started_s = summaryOf(started);
  summary.frame_ms = summaryOf(ms);
  summary.added_ate_m = summaryOf(added);
  return summary;
}

std::vector<std::string> describeUncounted(const TrialRecord& record) {
  std::vector<std::string> sentences;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const TrialSummary all =
        summaryOf(record, [&](const TrialRun& run) { return run.recording == sequence.name; });
    if (all.not_judged == 0) continue;
    const int runs = all.runs + all.not_judged, known = all.causal_ate_m.count;
    std::string text = sequence.name + ": ";
    text += sequence.has_ground_truth
                ? format("ground truth covers %d of %d runs, each by %.0f %% of its poses", known,
                         runs, 100.0 * kMinCoverage)
                : std::string("there is no ground truth");
    text += format("; %d of %d runs are not judged", all.not_judged, runs);
    if (sequence.has_ground_truth && known == 0) text += "; is it on the same clock?";
    sentences.push_back(text);
  }
  for (const NamedText& fault : record.faults) {
    const TrialSummary all =
        summaryOf(record, [&](const TrialRun& run) { return run.fault == fault.name; });
    if (all.not_met == 0) continue;
    sentences.push_back(format("fault '%s': it changes no measurement in %d of %d runs, which do "
                               "not count; does it lie within them (",
                               fault.name.c_str(), all.not_met,
                               all.not_met + all.runs + all.not_judged) +
                        fault.text + ")?");
  }
  return sentences;
}

FigureSummary afterStart(const TrialRecord& record, const TrialVariant& variant, double after_s,
                         double ErrorsAfterStart::*figure) {
  std::vector<double> values;
  for (const TrialRun& run : record.results)
    if (run.fault == kNoFault && run.variant == variant)
      for (const ErrorsAfterStart& errors : run.after_start)
        if (errors.after_s == after_s) values.push_back(errors.*figure);
  return summaryOf(values);
}

std::vector<FailureKind> failuresOf(const TrialRecord& record) {
  std::map<std::string, FailureKind> kinds;
  for (size_t i = 0; i < record.results.size(); ++i) {
    const TrialRun& run = record.results[i];
    if (run.survived() || !run.judged()) continue;
    FailureKind& kind = kinds[withoutFigures(run.reason)];
    if (kind.runs.empty()) kind.reason = run.reason;
    kind.runs.push_back(i);
  }
  std::vector<FailureKind> sorted;
  for (auto& [key, kind] : kinds) sorted.push_back(std::move(kind));
  std::stable_sort(sorted.begin(), sorted.end(), [](const FailureKind& a, const FailureKind& b) {
    return a.runs.size() > b.runs.size();
  });
  return sorted;
}

}  // namespace etalon
