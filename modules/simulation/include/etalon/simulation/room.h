#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

/** A box with vertical edges that stands or hangs in the room. */
struct RoomBox {
  Eigen::Vector3d centre;     ///< p_W, m
  Eigen::Vector3d half_size;  ///< along its own axes, m
  double yaw = 0.0;           ///< of its axes against W's, rad
};

/** A rectangular room along W's axes, and boxes in it: the geometry that is rendered. */
struct Room {
  Eigen::Vector3d low, high;  ///< inner corners, p_W, m
  std::vector<RoomBox> boxes;

  /**
   * The first surface on the ray origin + s direction, s > 0, as a point p_W; nothing if the origin
   * is outside of the room. `direction` need not be of unit length.
   */
  std::optional<Eigen::Vector3d> firstHit(const Eigen::Vector3d& origin,
                                          const Eigen::Vector3d& direction) const;
};

struct RoomOptions {
  double wall_distance_m = 2.2;   ///< least distance between flight and walls
  double floor_distance_m = 0.4;  ///< between the flight's lowest point and the floor
  double ceiling_distance_m = 1.3;
  double box_distance_m = 0.7;  ///< least distance between flight and boxes
  std::uint64_t seed = 1;
};

/** A room around the flight with furniture where the flight does not pass. */
Room makeRoom(const SimulatedTrajectory& trajectory, const RoomOptions& options = {});

}  // namespace etalon
