#pragma once

#include <optional>
#include <string>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/alignment.h"

namespace etalon {

struct TrajectoryPlotOptions {
  std::string title;  ///< ASCII
  /** How the estimate is aligned with ground truth before it is drawn; nothing: it is aligned. */
  std::optional<AlignmentType> alignment = AlignmentType::kYawPosition;
  /** The instant to mark in the top view and over time. */
  std::optional<TimeNs> initialized_at;
};

/**
 * Draws a trajectory as PNG of 1600x800 pixels. Left: top view (x, y, equal scale) with ground
 * truth. Right: position and rotation error over time; without ground truth height and speed.
 * Times count from the first pose. An empty estimate gives a picture that says so.
 * @throws DataError if the file cannot be written
 */
void drawTrajectoryPlot(const std::string& path, const Trajectory& estimate,
                        const GroundTruth& ground_truth, const TrajectoryPlotOptions& options = {});

}  // namespace etalon
