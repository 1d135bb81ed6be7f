#include "rendered_room.h"

#include <gtest/gtest.h>

#include <cmath>

namespace etalon {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Ray = RenderedRoom::Ray;

/** A room of 8 m x 6 m x 4 m around (1, 2, 3) with a box of 1 m turned by 30 degrees, ahead in x. */
Room roomWithBox() {
  Room room;
  room.low = Vector3d(1, 2, 3) - Vector3d(4, 3, 2);
  room.high = Vector3d(1, 2, 3) + Vector3d(4, 3, 2);
  room.boxes.push_back({Vector3d(1, 2, 3) + Vector3d(2, 0, 0), {0.5, 0.5, 0.5}, M_PI / 6.0});
  return room;
}

Room emptyRoom() {
  Room room = roomWithBox();
  room.boxes.clear();
  return room;
}

float brightness(const RenderedRoom& room, const Vector3f& origin, const Vector3f& direction,
                 float spread = 1e-3f) {
  const Ray ray{direction, spread, direction.norm()};
  return room.brightness(origin, room.placed(origin), Eigen::Matrix3f::Identity(), &ray, 1);
}

TEST(RenderedRoom, PositionsCountFromItsMiddle) {
  const RenderedRoom room(emptyRoom(), 1);
  EXPECT_EQ(room.inRoom({1, 2, 3}), Vector3f(0, 0, 0));
  EXPECT_EQ(room.inRoom({5, 5, 5}), Vector3f(4, 3, 2));
}

TEST(RenderedRoom, ABoxIsPlacedInItsOwnAxes) {
  const RenderedRoom room(roomWithBox(), 1);
  const auto placed = room.placed({2, 1, 0});  // a metre beside the box, along the room's y
  ASSERT_EQ(placed.size(), 1U);
  EXPECT_EQ(placed[0].index, 0U);
  const float c = std::cos(static_cast<float>(M_PI) / 6.0f);
  EXPECT_LT((placed[0].origin - Vector3f(0.5f, c, 0.0f)).norm(), 1e-6f);
}

TEST(RenderedRoom, WhatIsSeenIsThePointAndNotTheWayToIt) {
  // A point of a wall from two places: the light and the texture are those of the point; so small a
  // footprint changes nothing.
  const RenderedRoom room(emptyRoom(), 1);
  for (const float z : {-1.0f, 0.2f, 1.3f}) {
    const Vector3f point(4.0f, 0.7f, z);
    const Vector3f a(0, 0, 0), b(-2, 1, 0.5f);
    EXPECT_NEAR(brightness(room, a, point - a, 1e-6f), brightness(room, b, point - b, 1e-6f), 1.0f);
  }
}

TEST(RenderedRoom, ABoxHidesWhatIsBehindIt) {
  const RenderedRoom empty(emptyRoom(), 1), furnished(roomWithBox(), 1);
  const Vector3f origin(0, 0, 0);
  int hidden = 0;
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) {
      const Vector3f direction(1.0f, 0.03f * static_cast<float>(i), 0.03f * static_cast<float>(j));
      const bool differs =
          brightness(empty, origin, direction) != brightness(furnished, origin, direction);
      // The box is inside of a sphere of 0.87 m and around one of 0.5 m, 2 m away.
      const float off = std::acos(direction.normalized().x());
      if (off < std::asin(0.5f / 2.0f) - 0.02f) {
        hidden += differs;
      } else if (off > std::asin(0.8661f / 2.0f)) {
        EXPECT_FALSE(differs) << i << ", " << j;
      }
    }
  EXPECT_GT(hidden, 150);  // of some 200: two surfaces may be of one gray
}

TEST(RenderedRoom, ABoxThatIsNoCandidateIsNotSeen) {
  const RenderedRoom empty(emptyRoom(), 1), furnished(roomWithBox(), 1);
  const Ray ahead{{1, 0, 0}, 1e-3f, 1.0f};
  const Eigen::Matrix3f R_WC = Eigen::Matrix3f::Identity();
  EXPECT_EQ(furnished.brightness(Vector3f::Zero(), {}, R_WC, &ahead, 1),
            empty.brightness(Vector3f::Zero(), {}, R_WC, &ahead, 1));
}

TEST(RenderedRoom, RaysAreTurnedByTheCameraAndSummedWithoutTheDarkOnes) {
  const RenderedRoom room(emptyRoom(), 1);
  Eigen::Matrix3f R_WC;  // EuRoC's habit: the camera's z axis looks along x
  R_WC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Ray rays[] = {{{0, 0, 1}, 1e-3f, 1.0f}, {{0, 0, 1}, -1.0f, 1.0f}, {{0, 1, 0}, 1e-3f, 1.0f}};
  const Vector3f origin(0.1f, 0.2f, 0.3f);
  EXPECT_EQ(room.brightness(origin, {}, R_WC, rays, 3),
            brightness(room, origin, {1, 0, 0}) + brightness(room, origin, {0, 0, -1}));
}

TEST(RenderedRoom, RaysAlongAnAxisEndOnTheWall) {
  const RenderedRoom room(emptyRoom(), 1);
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      Vector3f direction = Vector3f::Zero();
      direction[axis] = sign;
      const float gray = brightness(room, {0.1f, 0.2f, 0.3f}, direction);
      EXPECT_TRUE(std::isfinite(gray));
      EXPECT_GT(gray, 5.0f);
      EXPECT_LT(gray, 300.0f);
    }
}

TEST(RenderedRoom, IsLighterNearTheLamp) {
  // Over many points of a wall, so that the texture does not matter: under the ceiling and at the
  // floor.
  const RenderedRoom room(emptyRoom(), 3);
  double high = 0.0, low = 0.0;
  for (int i = -20; i <= 20; ++i) {
    const float y = 0.07f * static_cast<float>(i);
    // As wide as the texture repeats: its mean.
    high += brightness(room, Vector3f::Zero(), {4.0f, y, 1.8f}, 10.0f);
    low += brightness(room, Vector3f::Zero(), {4.0f, y, -1.8f}, 10.0f);
  }
  EXPECT_GT(high, 1.02 * low);
}

}  // namespace
}  // namespace etalon
