#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "etalon/simulation/room.h"
#include "texture.h"

namespace etalon {

/**
 * A room with its textures and its light, which says how bright the surface is that a ray meets.
 * Positions are relative to the centre of the room, in the axes of the world, in m.
 */
class RenderedRoom {
 public:
  /** A box. */
  struct Solid {
    Eigen::Vector3f centre, half_size;
    float cos_yaw, sin_yaw, radius;
  };

  /** A box as seen from one position, the origin of many rays. */
  struct PlacedSolid {
    const Solid* solid;
    size_t index;            ///< of the solid in the room
    Eigen::Vector3f origin;  ///< that position, in the solid's axes
  };

  struct Ray {
    Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< of any length, in the camera's axes
    float spread = -1.0f;  ///< distance to the neighbouring ray where this one ends; < 0: no light
    float length = 0.0f;   ///< of the direction
  };

  /** The room's colours depend on the seed. */
  RenderedRoom(const Room& room, std::uint64_t seed);
  RenderedRoom(const RenderedRoom&) = delete;
  RenderedRoom& operator=(const RenderedRoom&) = delete;

  Eigen::Vector3f inRoom(const Eigen::Vector3d& p_W) const { return (p_W - middle_).cast<float>(); }

  /** All boxes, as seen from `origin`. */
  std::vector<PlacedSolid> placed(const Eigen::Vector3f& origin) const;

  /**
   * The gray levels of what `count` rays from `origin` meet first, summed.
   * @param candidates the boxes that they may meet, placed() for the same origin
   * @param R_WC from the camera's axes to the world's
   */
  float brightness(const Eigen::Vector3f& origin, const std::vector<PlacedSolid>& candidates,
                   const Eigen::Matrix3f& R_WC, const Ray* rays, int count) const;

 private:
  /** How a flat surface looks. */
  struct Coat {
    const Texture* texture;
    float offset_u, offset_v;  // m
    float brightness;
  };

  float trace(const Eigen::Vector3f& o, const std::vector<PlacedSolid>& candidates,
              const Eigen::Vector3f& direction, float spread, float length) const;
  float shade(const Coat& coat, float u, float v, float du, float dv, float footprint,
              float stretch, const Eigen::Vector3f& p) const;

  Eigen::Vector3d middle_;  // of the room, p_W
  Eigen::Vector3f half_room_;
  Eigen::Vector3f lamp_;
  float lamp_falloff_;  // 1/m^2
  std::vector<Solid> solids_;
  std::vector<Coat> room_coats_, solid_coats_;  // six a room, six a solid
  std::vector<Texture> textures_;
};

}  // namespace etalon
