#include "rendered_room.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "random.h"

namespace etalon {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr size_t kTextures = 4;

/** The direction, with components that are safe to divide by. */
Vector3f withoutZeros(Vector3f d) {
  constexpr float kTiny = 1e-12f;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(d[k]) < kTiny) d[k] = kTiny;
  }
  return d;
}

}  // namespace

RenderedRoom::RenderedRoom(const Room& room, std::uint64_t seed) {
  middle_ = 0.5 * (room.low + room.high);
  half_room_ = (0.5 * (room.high - room.low)).cast<float>();
  lamp_ = Vector3f(0.2f * half_room_.x(), -0.15f * half_room_.y(), 0.9f * half_room_.z());
  lamp_falloff_ = 2.0f / half_room_.squaredNorm();
  textures_.reserve(kTextures);
  for (size_t i = 0; i < kTextures; ++i) textures_.emplace_back(seed, i);

  Random random(seed, kTextureStream);
  const auto coat = [&](size_t texture, double low, double high) {
    const double period = static_cast<double>(Texture::kSize) * Texture::kTexelSize;
    const double u = random.uniform(0.0, period), v = random.uniform(0.0, period);
    const double brightness = random.uniform(low, high);
    return Coat{&textures_[texture], static_cast<float>(u), static_cast<float>(v),
                static_cast<float>(brightness)};
  };
  constexpr std::array<size_t, 6> kFaceTextures = {0, 2, 3, 0, 1, 2};  // walls, floor, ceiling
  for (size_t face = 0; face < 6; ++face)
    room_coats_.push_back(coat(kFaceTextures[face], 0.7, 1.1));
  for (const RoomBox& box : room.boxes) {
    Solid solid;
    solid.centre = (box.centre - middle_).cast<float>();
    solid.half_size = box.half_size.cast<float>();
    solid.cos_yaw = static_cast<float>(std::cos(box.yaw));
    solid.sin_yaw = static_cast<float>(std::sin(box.yaw));
    solid.radius = solid.half_size.norm();
    solids_.push_back(solid);
    const size_t texture = random.uniformInt(static_cast<int>(kTextures));
    for (size_t face = 0; face < 6; ++face) solid_coats_.push_back(coat(texture, 0.6, 1.25));
  }
}

std::vector<RenderedRoom::PlacedSolid> RenderedRoom::placed(const Vector3f& origin) const {
  std::vector<PlacedSolid> placed;
  for (size_t k = 0; k < solids_.size(); ++k) {
    const Solid& s = solids_[k];
    const Vector3f o = origin - s.centre;
    const Vector3f turned(s.cos_yaw * o.x() + s.sin_yaw * o.y(),
                          -s.sin_yaw * o.x() + s.cos_yaw * o.y(), o.z());
    placed.push_back({&s, k, turned});
  }
  return placed;
}

/**
 * Brightness of a surface at (u, v). The footprint of a ray is an ellipse, `stretch` times longer
 * along (du, dv) than across; up to four lookups lie along it.
 */
float RenderedRoom::shade(const Coat& coat, float u, float v, float du, float dv, float footprint,
                          float stretch, const Vector3f& p) const {
  const float cu = u + coat.offset_u, cv = v + coat.offset_v;
  float gray;
  if (stretch < 1.6f) {
    gray = coat.texture->sample(cu, cv, footprint * stretch);
  } else {
    const int taps = stretch < 3.0f ? 2 : 4;
    const float length = footprint * std::min(stretch, 16.0f);
    const float width = std::max(footprint, length / static_cast<float>(taps));
    const float norm = length / std::sqrt(du * du + dv * dv);
    gray = 0.0f;
    for (int i = 0; i < taps; ++i) {
      const float s = ((static_cast<float>(i) + 0.5f) / static_cast<float>(taps) - 0.5f) * norm;
      gray += coat.texture->sample(cu + s * du, cv + s * dv, width);
    }
    gray /= static_cast<float>(taps);
  }
  const float light = 0.55f + 0.65f / (1.0f + (p - lamp_).squaredNorm() * lamp_falloff_);
  return gray * coat.brightness * light;
}

float RenderedRoom::trace(const Vector3f& o, const std::vector<PlacedSolid>& candidates,
                          const Vector3f& direction, float spread, float length) const {
  const Vector3f d = withoutZeros(direction);
  // The ray leaves the room: its walls are hit from inside.
  const float sx = (std::copysign(half_room_.x(), d.x()) - o.x()) / d.x();
  const float sy = (std::copysign(half_room_.y(), d.y()) - o.y()) / d.y();
  const float sz = (std::copysign(half_room_.z(), d.z()) - o.z()) / d.z();
  float nearest = std::min(sx, std::min(sy, sz));
  int axis = nearest == sx ? 0 : nearest == sy ? 1 : 2;
  const PlacedSolid* hit = nullptr;
  Vector3f hit_d = d;
  for (const PlacedSolid& placed : candidates) {
    const Solid& solid = *placed.solid;
    const Vector3f e = withoutZeros({solid.cos_yaw * d.x() + solid.sin_yaw * d.y(),
                                     -solid.sin_yaw * d.x() + solid.cos_yaw * d.y(), d.z()});
    float enter = 0.0f, leave = nearest;
    int enter_axis = -1;
    for (int k = 0; k < 3; ++k) {
      const float inverse = 1.0f / e[k];
      const float middle_s = -placed.origin[k] * inverse;
      const float half_s = std::abs(solid.half_size[k] * inverse);
      if (middle_s - half_s > enter) {
        enter = middle_s - half_s;
        enter_axis = k;
      }
      leave = std::min(leave, middle_s + half_s);
    }
    if (enter_axis >= 0 && enter < leave) {
      nearest = enter;
      axis = enter_axis;
      hit = &placed;
      hit_d = e;
    }
  }
  const Vector3f p = o + nearest * d;
  const Vector3f local = hit ? Vector3f(hit->origin + nearest * hit_d) : p;
  const size_t face = 2 * axis + (hit_d[axis] > 0.0f ? 1 : 0);
  const Coat& coat = hit ? solid_coats_[6 * hit->index + face] : room_coats_[face];
  const int iu = axis == 0 ? 1 : 0, iv = axis == 2 ? 1 : 2;
  const float footprint = nearest * spread;
  const float stretch = length / std::abs(hit_d[axis]);
  return shade(coat, local[iu], local[iv], hit_d[iu], hit_d[iv], footprint, stretch, p);
}

float RenderedRoom::brightness(const Vector3f& origin, const std::vector<PlacedSolid>& candidates,
                               const Eigen::Matrix3f& R_WC, const Ray* rays, int count) const {
  float sum = 0.0f;
  for (int k = 0; k < count; ++k) {
    const Ray& ray = rays[k];
    if (ray.spread >= 0.0f)
      sum += trace(origin, candidates, R_WC * ray.direction, ray.spread, ray.length);
  }
  return sum;
}

}  // namespace etalon
