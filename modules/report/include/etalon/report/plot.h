#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/trajectory_evaluation.h"

namespace etalon {

struct TrajectoryPlotOptions {
  std::string title;  ///< ASCII
  /** How the estimate is aligned with ground truth before it is drawn; nothing: it is aligned. */
  std::optional<AlignmentType> alignment = AlignmentType::kYawPosition;
  /** The poses whose errors are drawn and that are aligned; nothing: all of the estimate, with the
   * ground truth interpolated. */
  std::optional<AssociatedTrajectories> pairs;
  /** The instant to mark in the top view and over time. */
  std::optional<TimeNs> initialized_at;
  /** In the legend; ASCII. */
  std::string estimate_name = "estimate", truth_name = "ground truth";
};

/**
 * Draws a trajectory as .png or .svg of 1600x800 pixels. Left: top view (x, y, equal scale) with ground
 * truth. Right: position and rotation error over time; without ground truth height and speed.
 * Times count from the first pose. An empty estimate gives a picture that says so.
 * @throws DataError if the file cannot be written
 */
void drawTrajectoryPlot(const std::string& path, const Trajectory& estimate,
                        const GroundTruth& ground_truth, const TrajectoryPlotOptions& options = {});

/** The same picture as the text of an svg element. */
std::string trajectoryPlotSvg(const Trajectory& estimate, const GroundTruth& ground_truth,
                              const TrajectoryPlotOptions& options = {});

/** A trajectory and what it is called in a legend (ASCII). */
struct NamedTrajectory {
  std::string name;
  Trajectory trajectory;
};

/**
 * Draws several trajectories in one picture of 1800x900 pixels, .png or .svg: top view, then x, y, z
 * and roll, pitch, yaw (Z-Y-X, of the rotation since the first pose, about the world's axes) over
 * time. Each is aligned with the ground truth, which is drawn below them in grey; without ground
 * truth they are drawn as they are.
 * @throws DataError if the file cannot be written
 */
void drawTrajectories(const std::string& path, const std::vector<NamedTrajectory>& runs,
                      const GroundTruth& ground_truth,
                      AlignmentType alignment = AlignmentType::kYawPosition);

}  // namespace etalon
