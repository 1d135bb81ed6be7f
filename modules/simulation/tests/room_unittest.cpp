#include "etalon/simulation/room.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/simulation/profile_trajectory.h"
#include "random.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

ProfileTrajectory flight() {
  ProfileOptions options;
  options.duration_s = 10.0;
  return ProfileTrajectory(options);
}

/** How deep `p` is in the box, m; negative outside. */
double depthIn(const RoomBox& box, const Vector3d& p) {
  const Vector3d local =
      Eigen::AngleAxisd(-box.yaw, Vector3d::UnitZ()).toRotationMatrix() * (p - box.centre);
  return (box.half_size - local.cwiseAbs()).minCoeff();
}

/** How far `p` is from the nearest wall, m; negative outside. */
double distanceToWalls(const Room& room, const Vector3d& p) {
  return std::min((p - room.low).minCoeff(), (room.high - p).minCoeff());
}

class RoomOfAFlight : public ::testing::Test {
 protected:
  const ProfileTrajectory trajectory = flight();
  const Room room = makeRoom(trajectory);
  Random random{5, 99};
};

TEST_F(RoomOfAFlight, ARayEndsOnASurfaceAndPassesNone) {
  for (int i = 0; i < 400; ++i) {
    const Vector3d origin =
        trajectory.at(trajectory.start() + static_cast<TimeNs>(random.uniform(0, 1e10))).T_WB.t;
    const Vector3d direction = random.direction();
    const auto hit = room.firstHit(origin, direction);
    ASSERT_TRUE(hit.has_value());
    EXPECT_LT((*hit - origin).cross(direction).norm(), 1e-9 * (*hit - origin).norm());
    EXPECT_GT((*hit - origin).dot(direction), 0.0);
    // On a wall or on a box, to rounding.
    double off = std::abs(distanceToWalls(room, *hit));
    for (const RoomBox& box : room.boxes) off = std::min(off, std::abs(depthIn(box, *hit)));
    EXPECT_LT(off, 1e-9);
    // Nothing before it: every point on the way is in the room and in no box.
    for (int k = 0; k < 50; ++k) {
      const Vector3d p = origin + (k / 50.0) * (*hit - origin);
      EXPECT_GT(distanceToWalls(room, p), 0.0);
      for (const RoomBox& box : room.boxes) EXPECT_LT(depthIn(box, p), 1e-9);
    }
  }
}

TEST_F(RoomOfAFlight, TheLengthOfADirectionDoesNotMatter) {
  const Vector3d origin = trajectory.at(trajectory.start()).T_WB.t;
  for (int i = 0; i < 100; ++i) {
    const Vector3d direction = random.direction();
    const auto unit = room.firstHit(origin, direction),
               longer = room.firstHit(origin, 7 * direction);
    ASSERT_TRUE(unit && longer);
    EXPECT_LT((*unit - *longer).norm(), 1e-12 * 100);
  }
}

TEST_F(RoomOfAFlight, FromOutsideNothingIsSeen) {
  EXPECT_FALSE(room.firstHit(room.high + Vector3d(1, 0, 0), {-1, 0, 0}).has_value());
  EXPECT_FALSE(room.firstHit(room.low - Vector3d(0, 0, 1), {0, 0, 1}).has_value());
}

TEST_F(RoomOfAFlight, AlongAnAxisTheWallIsWhereItStands) {
  Room empty = room;
  empty.boxes.clear();
  const Vector3d origin = 0.5 * (room.low + room.high);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const auto hit = empty.firstHit(origin, sign * Vector3d::Unit(axis));
      ASSERT_TRUE(hit.has_value());
      EXPECT_NEAR((*hit)[axis], sign < 0 ? room.low[axis] : room.high[axis], 1e-12);
    }
}

TEST_F(RoomOfAFlight, ABoxStandsInItsOwnYaw) {
  Room one = room;
  const Vector3d middle = 0.5 * (room.low + room.high);
  one.boxes = {{middle, {0.5, 0.25, 0.25}, M_PI / 2}};
  // Turned by a quarter: half a metre along y, a quarter along x.
  const auto along_y = one.firstHit(middle - Vector3d(0, 1, 0), {0, 1, 0});
  const auto along_x = one.firstHit(middle - Vector3d(1, 0, 0), {1, 0, 0});
  ASSERT_TRUE(along_x && along_y);
  EXPECT_NEAR(along_y->y(), middle.y() - 0.5, 1e-12);
  EXPECT_NEAR(along_x->x(), middle.x() - 0.25, 1e-12);
}

}  // namespace
}  // namespace etalon
