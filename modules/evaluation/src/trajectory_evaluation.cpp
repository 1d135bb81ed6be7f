#include "etalon/evaluation/trajectory_evaluation.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

TimeNs distance(TimeNs a, TimeNs b) { return a < b ? b - a : a - b; }

/** Index of the pose nearest in time; the earlier one of two. @param poses not empty */
size_t nearest(const Trajectory& poses, TimeNs t) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), t,
                       [](const StampedPose& p, TimeNs value) { return p.t < value; });
  const size_t index = after - poses.begin();
  if (index == poses.size()) return index - 1;
  if (index > 0 && distance(poses[index - 1].t, t) <= distance(poses[index].t, t)) return index - 1;
  return index;
}

PoseError errorOf(TimeNs t, const SE3& truth, const SE3& estimate) {
  return {t, (estimate.t - truth.t).norm(),
          degrees(logSO3(truth.R.transpose() * estimate.R).norm())};
}

TrajectoryErrors summarize(const std::vector<PoseError>& errors) {
  std::vector<double> position_m, rotation_deg;
  for (const PoseError& e : errors) {
    position_m.push_back(e.position_m);
    rotation_deg.push_back(e.rotation_deg);
  }
  return {statisticsOf(std::move(position_m)), statisticsOf(std::move(rotation_deg))};
}

/** Indices of the chain's poses; see relativeErrors(). */
std::vector<size_t> chain(const Trajectory& estimate, const RelativeDelta& delta) {
  std::vector<size_t> indices;
  if (delta.unit == DeltaUnit::kFrames) {
    const size_t step = delta.length;
    for (size_t i = 0; i < estimate.size(); i += step) indices.push_back(i);
    return indices;
  }
  double path = 0.0;
  for (size_t i = 1; i < estimate.size(); ++i) {
    path += (estimate[i].T_WB.t - estimate[i - 1].T_WB.t).norm();
    if (path < delta.length) continue;
    indices.push_back(i);
    path = 0.0;
  }
  return indices;
}

}  // namespace

AssociatedTrajectories associate(const Trajectory& estimate, const Trajectory& reference,
                                 double max_difference_s) {
  const bool reference_longer = reference.size() > estimate.size();
  const Trajectory& shorter = reference_longer ? estimate : reference;
  const Trajectory& longer = reference_longer ? reference : estimate;
  const TimeNs limit = durationNs(std::min(max_difference_s, 1e9));
  std::vector<std::pair<size_t, size_t>> pairs;  // of the shorter, of the longer
  for (size_t i = 0; i < shorter.size(); ++i) {
    const size_t j = nearest(longer, shorter[i].t);
    const TimeNs difference = distance(shorter[i].t, longer[j].t);
    if (difference > limit) continue;
    if (pairs.empty() || pairs.back().second != j)
      pairs.emplace_back(i, j);
    else if (difference < distance(shorter[pairs.back().first].t, longer[j].t))
      pairs.back().first = i;
  }
  AssociatedTrajectories result;
  for (const auto& [i, j] : pairs) {
    result.estimate.push_back(reference_longer ? shorter[i] : longer[j]);
    result.reference.push_back(reference_longer ? longer[j] : shorter[i]);
  }
  return result;
}

AssociatedTrajectories associate(const Trajectory& estimate, const GroundTruth& ground_truth) {
  AssociatedTrajectories result;
  for (const StampedPose& pose : estimate)
    if (const std::optional<StampedState> truth = ground_truth.at(pose.t)) {
      result.estimate.push_back(pose);
      result.reference.push_back({pose.t, truth->T_WB});
    }
  return result;
}

std::optional<Alignment> alignmentOf(const AssociatedTrajectories& trajectories,
                                     AlignmentType type) {
  if (trajectories.estimate.empty()) return std::nullopt;
  std::vector<Eigen::Vector3d> p_G, p_W;
  for (const StampedPose& pose : trajectories.reference) p_G.push_back(pose.T_WB.t);
  for (const StampedPose& pose : trajectories.estimate) p_W.push_back(pose.T_WB.t);
  return alignPoints(p_G, p_W, type);
}

std::vector<PoseError> poseErrors(const AssociatedTrajectories& trajectories) {
  const auto& [estimate, reference] = trajectories;
  std::vector<PoseError> errors;
  for (size_t i = 0; i < estimate.size(); ++i)
    errors.push_back(errorOf(estimate[i].t, reference[i].T_WB, estimate[i].T_WB));
  return errors;
}

TrajectoryErrors absoluteErrors(const AssociatedTrajectories& trajectories,
                                std::optional<AlignmentType> type) {
  AssociatedTrajectories aligned = trajectories;
  if (type)
    if (const std::optional<Alignment> alignment = alignmentOf(trajectories, *type))
      aligned.estimate = transformed(trajectories.estimate, *alignment);
  return summarize(poseErrors(aligned));
}

DeltaUnit deltaUnitFromName(const std::string& name) {
  if (name == "frames") return DeltaUnit::kFrames;
  if (name == "meters") return DeltaUnit::kMeters;
  throw ConfigError("unit '" + name + "': expected frames or meters");
}

TrajectoryErrors relativeErrors(const AssociatedTrajectories& trajectories,
                                const RelativeDelta& delta) {
  const bool frames = delta.unit == DeltaUnit::kFrames;
  if (!(delta.length > 0.0 && std::isfinite(delta.length)) ||
      (frames && (delta.length != std::floor(delta.length) || delta.length > 1e9))) {
    throw ConfigError(format("delta %g: expected %s", delta.length,
                             frames ? "a whole number of frames, 1 or more" : "more than 0 m"));
  }
  const auto& [estimate, reference] = trajectories;
  const std::vector<size_t> indices = chain(estimate, delta);
  std::vector<PoseError> errors;
  for (size_t k = 1; k < indices.size(); ++k) {
    const size_t i = indices[k - 1], j = indices[k];
    errors.push_back(errorOf(estimate[j].t, reference[i].T_WB.inverse() * reference[j].T_WB,
                             estimate[i].T_WB.inverse() * estimate[j].T_WB));
  }
  return summarize(errors);
}

}  // namespace etalon
