#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/nav_state.h"
#include "etalon/core/se3.h"
#include "etalon/core/time.h"

namespace etalon {

struct StampedPose {
  TimeNs t = 0;
  SE3 T_WB;
};

/** Poses in strictly increasing time. */
using Trajectory = std::vector<StampedPose>;

/** Ground truth of a recording, strictly increasing in time; empty where there is none. */
struct GroundTruth {
  std::vector<StampedState> states;  ///< velocity and biases are zero where there are none
  bool has_velocity = false;
  bool has_biases = false;

  bool empty() const { return states.empty(); }

  /**
   * State at `t`, interpolated between its neighbours (rotation geodesically, position by the cubic
   * Hermite polynomial of positions and velocities where there are velocities, else linearly; the
   * rest linearly). Nothing outside the recording or inside a gap longer than `max_gap_s`.
   */
  std::optional<StampedState> at(TimeNs t, double max_gap_s = 0.1) const;
};

/**
 * The trajectory after some of its poses were improved. A pose between two improved ones is carried
 * along with both, weighted by the time to each; a pose before the first or after the last improved
 * one is carried along with that one.
 * @param better the improved poses in increasing order of time; those whose stamp `trajectory` does
 *        not have are left out
 */
Trajectory carriedAlong(const Trajectory& trajectory, const Trajectory& better);

/**
 * Writes lines `t[s, 9 decimals] x y z qx qy qz qw` (TUM format).
 * @param frames which poses they are, one line; the file begins with it
 * @throws DataError if the file cannot be written
 */
void writeTum(const std::string& path, const Trajectory& trajectory,
              const std::string& frames = "T_WB");

/** Reads a TUM file; comments start with '#'. Throws DataError naming file and line. */
Trajectory readTum(const std::string& path);

}  // namespace etalon
