#include "etalon/simulation/room.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "random.h"

namespace etalon {

using Eigen::Vector3d;

namespace {

Vector3d toBox(const RoomBox& box, const Vector3d& v) {
  const double c = std::cos(box.yaw), s = std::sin(box.yaw);
  return {c * v.x() + s * v.y(), -s * v.x() + c * v.y(), v.z()};
}

/** Smallest s > 0 at which the ray enters the box; infinity if it does not. */
double entryOf(const RoomBox& box, const Vector3d& origin, const Vector3d& direction) {
  const Vector3d o = toBox(box, origin - box.centre), d = toBox(box, direction);
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (-box.half_size[k] - o[k]) / d[k], b = (box.half_size[k] - o[k]) / d[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave && enter > 0.0 ? enter : std::numeric_limits<double>::infinity();
}

double distanceTo(const RoomBox& box, const Vector3d& p) {
  const Vector3d inside = toBox(box, p - box.centre).cwiseAbs() - box.half_size;
  return inside.cwiseMax(0.0).norm();
}

/** A piece of furniture on the floor, or now and then one that hangs on a wall. */
RoomBox randomBox(const Room& room, Random* random) {
  const Vector3d size = room.high - room.low;
  RoomBox box;
  box.half_size = {random->uniform(0.15, 0.6), random->uniform(0.15, 0.6),
                   0.5 * size.z() * std::min(0.9, random->uniform(0.1, 0.75))};
  box.yaw = random->uniform(0.0, M_PI);
  for (int k = 0; k < 2; ++k) box.centre[k] = random->uniform(room.low[k], room.high[k]);
  box.centre.z() = room.low.z() + box.half_size.z();
  if (random->uniform() < 0.4) {  // on a wall
    const int axis = random->uniformInt(2);
    const bool far_side = random->uniform() < 0.5;
    box.yaw = 0.0;
    box.half_size[axis] = random->uniform(0.1, 0.35);
    box.half_size.z() = random->uniform(0.15, 0.5);
    box.centre[axis] = far_side ? room.high[axis] : room.low[axis];
    box.centre.z() = random->uniform(room.low.z() + 0.6, room.high.z() - 0.4);
  }
  return box;
}

}  // namespace

std::optional<Vector3d> Room::firstHit(const Vector3d& origin, const Vector3d& direction) const {
  if ((origin.array() < low.array()).any() || (origin.array() > high.array()).any()) {
    return std::nullopt;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double wall = direction[k] > 0.0 ? high[k] : low[k];
    if (direction[k] != 0.0) nearest = std::min(nearest, (wall - origin[k]) / direction[k]);
  }
  for (const RoomBox& box : boxes) nearest = std::min(nearest, entryOf(box, origin, direction));
  if (!std::isfinite(nearest)) return std::nullopt;
  return origin + nearest * direction;
}

Room makeRoom(const SimulatedTrajectory& trajectory, const RoomOptions& options) {
  constexpr double kLeastWidth = 5.0, kLeastHeight = 3.0;  // m
  constexpr int kMostBoxes = 28;
  constexpr TimeNs kSampling = 50'000'000;
  std::vector<Vector3d> flight;
  Eigen::AlignedBox3d bounds;
  for (TimeNs t = trajectory.start(); t <= trajectory.end(); t += kSampling) {
    const Vector3d p = trajectory.at(t).T_WB.t;
    bounds.extend(p);
    if (flight.empty() || (p - flight.back()).norm() > 0.05) flight.push_back(p);
  }
  Room room;
  const Vector3d middle = bounds.center();
  for (int k = 0; k < 2; ++k) {
    const double half =
        std::max(0.5 * bounds.sizes()[k] + options.wall_distance_m, 0.5 * kLeastWidth);
    room.low[k] = middle[k] - half;
    room.high[k] = middle[k] + half;
  }
  room.low.z() = bounds.min().z() - options.floor_distance_m;
  room.high.z() =
      std::max(bounds.max().z() + options.ceiling_distance_m, room.low.z() + kLeastHeight);

  Random random(options.seed, kRoomStream);
  const Vector3d size = room.high - room.low;
  const int wanted = std::clamp(static_cast<int>(size.x() * size.y() / 3.0), 6, kMostBoxes);
  for (int attempt = 0; attempt < 40 * wanted; ++attempt) {
    const RoomBox box = randomBox(room, &random);
    const bool clear = std::all_of(flight.begin(), flight.end(), [&](const Vector3d& p) {
      return distanceTo(box, p) > options.box_distance_m;
    });
    if (clear) room.boxes.push_back(box);
    if (static_cast<int>(room.boxes.size()) == wanted) break;
  }
  return room;
}

}  // namespace etalon
