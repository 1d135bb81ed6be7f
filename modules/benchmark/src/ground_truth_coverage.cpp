#include "etalon/benchmark/ground_truth_coverage.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/core/text.h"

namespace etalon {

namespace {

constexpr TimeNs kMostBetween = kNanosecondsPerSecond;

/** Rounds down, because 99.9 % is not all. Rounding errors next to a whole number do not count. */
std::string percent(double share) { return format("%.0f %%", std::floor(100.0 * share + 1e-9)); }

double shareOf(size_t covered, size_t total) {
  return total == 0 ? 0.0 : static_cast<double>(covered) / static_cast<double>(total);
}

}  // namespace

bool coversEnough(size_t covered, size_t total, double wanted) {
  if (covered == 0 || covered >= total) return covered > 0;
  return covered >= kMinCoveredPoses && shareOf(covered, total) >= wanted;
}

size_t coveredPoses(const Trajectory& trajectory, const GroundTruth& ground_truth) {
  return static_cast<size_t>(
      std::count_if(trajectory.begin(), trajectory.end(),
                    [&](const StampedPose& pose) { return ground_truth.at(pose.t).has_value(); }));
}

size_t coveredPoses(const Trajectory& estimate, const AssociatedTrajectories& associated) {
  const Trajectory& with_truth = associated.estimate;  // a part of the estimate, in its order
  size_t covered = 0, before = 0;                      // before: with_truth up to the pose
  for (const StampedPose& pose : estimate) {
    while (before < with_truth.size() && with_truth[before].t <= pose.t) ++before;
    const bool itself = before > 0 && with_truth[before - 1].t == pose.t;
    const bool between = before > 0 && before < with_truth.size() &&
                         with_truth[before].t - with_truth[before - 1].t <= kMostBetween;
    if (itself || between) ++covered;
  }
  return covered;
}

void requireCoverage(AttemptRecord* attempt, double wanted) {
  for (StageRecord& stage : attempt->stages) {
    if (!stage.errors) continue;
    const int keyframes = stage.errors->keyframes;
    if (coversEnough(keyframes, stage.states.size(), wanted)) continue;
    stage.errors = WindowErrors();
    stage.errors->keyframes = keyframes;
  }
}

void requireCoverage(RunRecord* run, double wanted) {
  for (AttemptRecord& attempt : run->attempts) requireCoverage(&attempt, wanted);
  if (run->ground_truth && !coversEnough(static_cast<size_t>(run->ground_truth->covered_frames),
                                         static_cast<size_t>(run->ground_truth->frames), wanted))
    for (auto* errors : {&run->trajectory_errors, &run->smoothed_errors, &run->final_errors})
      errors->reset();
}

void requireCoverage(BenchmarkRecord* benchmark) {
  for (WindowResult& result : benchmark->results)
    requireCoverage(&result.attempt, benchmark->protocol.min_coverage);
}

bool coversEnough(const WindowResult& result, const BenchmarkProtocol& protocol) {
  return coversEnough(result.truth.size(), result.attempt.keyframes.size(), protocol.min_coverage);
}

std::string describeCoverage(const GroundTruthUse& use, double wanted) {
  const size_t covered = use.covered_frames;
  const size_t total = use.frames;
  if (covered == total) return "";
  std::string text = "ground truth covers " + std::to_string(covered) + " of " +
                     std::to_string(total) + " frames (" + percent(shareOf(covered, total)) + ")";
  if (!coversEnough(covered, total, wanted))
    text += "; at least " + percent(wanted) +
            " is wanted (--min-coverage): the error of the trajectory is not known";
  if (covered == 0) text += "; is it on the same clock?";
  return text;
}

std::vector<std::string> describeCoverage(const BenchmarkRecord& benchmark) {
  struct Windows {
    size_t all = 0, covered = 0;
  };
  std::map<std::string, Windows> windows;
  for (const WindowResult& result : benchmark.results) {
    Windows& w = windows[result.sequence];
    ++w.all;
    if (coversEnough(result, benchmark.protocol)) ++w.covered;
  }
  std::vector<std::string> sentences;
  for (const BenchmarkSequence& sequence : benchmark.sequences) {
    const Windows w = windows[sequence.name];
    if (w.covered == w.all) continue;
    if (!sequence.has_ground_truth) {
      sentences.push_back(sequence.name + ": there is no ground truth; the errors of its " +
                          std::to_string(w.all) + " results are not known");
      continue;
    }
    std::string text = sequence.name + ": ground truth covers " + std::to_string(w.covered) +
                       " of " + std::to_string(w.all) + " results, each by " +
                       percent(benchmark.protocol.min_coverage) +
                       " of its keyframes (--min-coverage); the errors of the others are not known";
    if (w.covered == 0) text += "; is it on the same clock?";
    sentences.push_back(text);
  }
  return sentences;
}

}  // namespace etalon
