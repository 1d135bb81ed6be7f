#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/alignment.h"
#include "etalon/evaluation/metrics.h"

namespace etalon {

// Errors of a whole trajectory with the conventions of evo (github.com/MichaelGrupp/evo), so that
// its figures and ours can be compared: poses are associated by their stamps, nothing is
// interpolated between the poses of a trajectory, the alignment is over all associated poses.

/** Poses that belong together: as many on both sides, in the same order, each with its own stamp.
 */
struct AssociatedTrajectories {
  Trajectory estimate, reference;
};

/**
 * Associates every pose of the shorter trajectory with the nearest in time of the longer one (the
 * estimate is the longer one of two that are equally long), if that is at most `max_difference_s`
 * away. Of several poses that are nearest to the same one the nearest of all is kept: each pose is
 * used once at most.
 */
AssociatedTrajectories associate(const Trajectory& estimate, const Trajectory& reference,
                                 double max_difference_s = 0.01);

/** The poses of the estimate that have ground truth (GroundTruth::at, which interpolates), with it.
 */
AssociatedTrajectories associate(const Trajectory& estimate, const GroundTruth& ground_truth);

/** The alignment of all positions (alignPoints()); nothing if there is none. */
std::optional<Alignment> alignmentOf(const AssociatedTrajectories& trajectories,
                                     AlignmentType type);

/** Error of one pose of a trajectory; the rotation's is the angle between the two. */
struct PoseError {
  TimeNs t = 0;  ///< of the estimate
  double position_m = 0.0, rotation_deg = 0.0;
};

/** Errors of every pose, both trajectories being in the same frame. */
std::vector<PoseError> poseErrors(const AssociatedTrajectories& trajectories);

/**
 * ATE: statistics of poseErrors() after alignment; nothing: as they are. Counts are zero if nothing
 * is associated.
 */
TrajectoryErrors absoluteErrors(const AssociatedTrajectories& trajectories,
                                std::optional<AlignmentType> alignment);

enum class DeltaUnit { kFrames, kMeters };

/** "frames" or "meters". @throws ConfigError for anything else. */
DeltaUnit deltaUnitFromName(const std::string& name);

/** A length over which the motion is compared. */
struct RelativeDelta {
  double length = 1.0;  ///< > 0; a whole number of frames, or metres
  DeltaUnit unit = DeltaUnit::kFrames;
};

/**
 * RPE: errors of the motion between consecutive poses of a chain, E = (T_Gi^-1 T_Gj)^-1 (T_Wi^-1
 * T_Wj): its translation and its angle. Frames: the chain holds every `length`-th associated pose.
 * Metres: the next pose of the chain is the first at which the estimate's path since the last one
 * is at least `length`; before the first one lies a path of this length as well.
 * @throws ConfigError if the length is not positive, or not a whole number of frames
 */
TrajectoryErrors relativeErrors(const AssociatedTrajectories& trajectories,
                                const RelativeDelta& delta);

}  // namespace etalon
