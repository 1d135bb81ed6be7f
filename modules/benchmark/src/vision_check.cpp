#include "etalon/benchmark/vision_check.h"

#include <optional>
#include <vector>

#include "etalon/benchmark/windows.h"
#include "etalon/core/statistics.h"
#include "etalon/evaluation/trajectory_evaluation.h"

namespace etalon {
namespace {

constexpr WindowShape kShape{10, 4.0};
constexpr double kEveryS = 1.0;

/** m; nothing where a keyframe has no ground truth. */
std::optional<double> absoluteError(const Trajectory& estimate, const GroundTruth& truth) {
  const AssociatedTrajectories both = associate(estimate, truth);
  if (both.estimate.size() < estimate.size()) return std::nullopt;
  return absoluteErrors(both, AlignmentType::kSE3).position_m.rmse;
}

}  // namespace

VisionCheck checkByVision(const SequenceTracks& tracks, const GroundTruth& recorded,
                          const GroundTruth& corrected) {
  VisionCheck check;
  if (tracks.frames.empty()) return check;
  std::vector<double> before, after;
  const int windows = windowCount(tracks.first_image, tracks.frames.back().t, kEveryS, kShape);
  for (int window = 0; window < windows; ++window) {
    const InitializationProblem problem = windowProblem(tracks, kEveryS, kShape, window, {}, {});
    if (problem.keyframeCount() < kShape.keyframes) continue;
    const auto& solution = problem.visualSolution();
    if (!solution) continue;
    Trajectory estimate;
    for (int k = 0; k < problem.keyframeCount(); ++k)
      estimate.push_back({problem.keyframe(k).t, solution->T_VB[k]});
    const auto from_recorded = absoluteError(estimate, recorded);
    const auto from_corrected = absoluteError(estimate, corrected);
    if (!from_recorded || !from_corrected) continue;
    before.push_back(*from_recorded);
    after.push_back(*from_corrected);
    check.corrected_is_nearer += *from_corrected < *from_recorded;
  }
  check.windows = before.size();
  if (check.windows == 0) return check;
  check.recorded_m = quantile(before, 0.5);
  check.corrected_m = quantile(after, 0.5);
  return check;
}

}  // namespace etalon
