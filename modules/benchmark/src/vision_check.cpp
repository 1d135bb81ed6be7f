#include "etalon/benchmark/vision_check.h"

#include <cmath>
#include <optional>
#include <vector>

#include "etalon/benchmark/windows.h"
#include "etalon/core/statistics.h"
#include "etalon/evaluation/alignment.h"

namespace etalon {
namespace {

constexpr WindowShape kShape{10, 4.0};
constexpr double kEveryS = 1.0;

/** m; nothing where a keyframe has no ground truth. */
std::optional<double> absoluteError(const std::vector<TimeNs>& stamps,
                                    const std::vector<Eigen::Vector3d>& estimate,
                                    const GroundTruth& truth) {
  std::vector<Eigen::Vector3d> positions;
  for (const TimeNs t : stamps) {
    const auto state = truth.at(t);
    if (!state) return std::nullopt;
    positions.push_back(state->T_WB.t);
  }
  const Alignment alignment = alignPoints(positions, estimate, AlignmentType::kSE3);
  double squares = 0.0;
  for (size_t k = 0; k < positions.size(); ++k)
    squares += (positions[k] - alignment * estimate[k]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(positions.size()));
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
    std::vector<TimeNs> stamps;
    std::vector<Eigen::Vector3d> estimate;
    for (int k = 0; k < problem.keyframeCount(); ++k) {
      stamps.push_back(problem.keyframe(k).t);
      estimate.push_back(solution->T_VB[k].t);
    }
    const auto from_recorded = absoluteError(stamps, estimate, recorded);
    const auto from_corrected = absoluteError(stamps, estimate, corrected);
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
