#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/core/time.h"
#include "etalon/core/trajectory.h"

namespace etalon {

/** Motion of the body B in the gravity-aligned world W. No NavState: no biases, but derivatives. */
struct TrajectoryState {
  TimeNs t = 0;
  SE3 T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s, in W
  Eigen::Vector3d a_W =
      Eigen::Vector3d::Zero();  ///< second derivative of B's position, m/s^2, in W
  Eigen::Vector3d omega_B =
      Eigen::Vector3d::Zero();  ///< angular rate of B relative to W, rad/s, in B
};

/** A motion of the body, known at every instant of [start(), end()]. Immutable; safe to read from
 * several threads. */
class SimulatedTrajectory {
 public:
  virtual ~SimulatedTrajectory() = default;

  TimeNs start() const { return start_; }
  TimeNs end() const { return end_; }

  /** The state at `t`; a `t` outside [start(), end()] counts as the nearer end. */
  virtual TrajectoryState at(TimeNs t) const = 0;

 protected:
  SimulatedTrajectory() = default;
  SimulatedTrajectory(const SimulatedTrajectory&) = default;
  SimulatedTrajectory& operator=(const SimulatedTrajectory&) = default;

  TimeNs start_ = 0;
  TimeNs end_ = 0;
};

inline Trajectory posesAt(const SimulatedTrajectory& trajectory,
                          const std::vector<TimeNs>& stamps) {
  Trajectory poses;
  for (const TimeNs t : stamps) poses.push_back({t, trajectory.at(t).T_WB});
  return poses;
}

/** The stamp start + k / rate_hz, rounded to the nearest nanosecond. */
inline TimeNs stampAtRate(TimeNs start, double rate_hz, std::int64_t k) {
  return start + static_cast<TimeNs>(std::llround(static_cast<double>(k) * 1e9 / rate_hz));
}

}  // namespace etalon
