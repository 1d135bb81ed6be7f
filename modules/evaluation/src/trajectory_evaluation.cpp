#include "etalon/evaluation/trajectory_evaluation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "etalon/core/degrees.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

TimeNs distance(TimeNs a, TimeNs b) { return a < b ? b - a : a - b; }

/** Index of the pose nearest in time; the earlier one of two. @param poses not empty */
size_t nearest(const Trajectory& poses, TimeNs t) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), t,
                       [](const StampedPose& p, TimeNs value) { return p.t < value; });
  const auto index = static_cast<size_t>(after - poses.begin());
  if (index == poses.size()) return index - 1;
  if (index > 0 && distance(poses[index - 1].t, t) <= distance(poses[index].t, t)) return index - 1;
  return index;
}

/** Collects the errors of pairs of motions or poses. */
class ErrorList {
 public:
  void add(const SE3& truth, const SE3& estimate) {
    const SE3 error = truth.inverse() * estimate;
    position_m_.push_back(error.t.norm());
    rotation_deg_.push_back(degrees(logSO3(error.R).norm()));
  }
  TrajectoryErrors errors() { return {statisticsOf(position_m_), statisticsOf(rotation_deg_)}; }

 private:
  std::vector<double> position_m_, rotation_deg_;
};

/** Indices of the chain's poses; see relativeErrors(). */
std::vector<size_t> chain(const Trajectory& estimate, const RelativeDelta& delta) {
  std::vector<size_t> indices;
  if (delta.unit == DeltaUnit::kFrames) {
    const auto step = static_cast<size_t>(delta.length);
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

TrajectoryErrors absoluteErrors(const AssociatedTrajectories& trajectories,
                                std::optional<AlignmentType> alignment) {
  const auto& [estimate, reference] = trajectories;
  if (estimate.empty()) return {};
  Alignment aligned;
  if (alignment) {
    std::vector<Eigen::Vector3d> p_G, p_W;
    for (const StampedPose& pose : reference) p_G.push_back(pose.T_WB.t);
    for (const StampedPose& pose : estimate) p_W.push_back(pose.T_WB.t);
    aligned = alignPoints(p_G, p_W, *alignment);
  }
  ErrorList list;
  for (size_t i = 0; i < estimate.size(); ++i)
    list.add(reference[i].T_WB, aligned * estimate[i].T_WB);
  return list.errors();
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
    char text[40];
    std::snprintf(text, sizeof text, "%g", delta.length);
    throw ConfigError(std::string("delta ") + text + ": expected " +
                      (frames ? "a whole number of frames, 1 or more" : "more than 0 m"));
  }
  const auto& [estimate, reference] = trajectories;
  const std::vector<size_t> indices = chain(estimate, delta);
  ErrorList list;
  for (size_t k = 1; k < indices.size(); ++k) {
    const size_t i = indices[k - 1], j = indices[k];
    list.add(reference[i].T_WB.inverse() * reference[j].T_WB,
             estimate[i].T_WB.inverse() * estimate[j].T_WB);
  }
  return list.errors();
}

}  // namespace etalon
