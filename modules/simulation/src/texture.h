#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

namespace etalon {

/**
 * A square gray texture that repeats in both directions, with its mipmap pyramid: shapes with sharp
 * corners at all sizes from half a metre down to centimetres, and fine noise, so that there are
 * corners to track from near and from far.
 */
class Texture {
 public:
  static constexpr int kSize = 2048;            ///< texels a side, a power of two
  static constexpr float kTexelSize = 0.0025f;  ///< m

  /** Textures of the same seed and index are the same, bit for bit. */
  Texture(std::uint64_t seed, std::uint64_t index);

  /** Trilinear lookup at (u, v) in m, filtered over about `footprint` m. Gray, 0..255. */
  float sample(float u, float v, float footprint) const {
    constexpr float kInvTexel = 1.0f / kTexelSize;
    const float texels = footprint * kInvTexel;
    u *= kInvTexel;
    v *= kInvTexel;
    if (texels <= 1.0f) return bilinear(levels_[0], u, v);
    // texels = 2^level (1 + share), read off the number's own binary form.
    std::uint32_t bits;
    std::memcpy(&bits, &texels, sizeof(bits));
    const size_t level = (bits >> 23) - 127;
    if (level + 1 >= levels_.size()) return bilinear(levels_.back(), u, v);
    const float share = static_cast<float>(bits & 0x7fffff) * 0x1.0p-23f;
    const float fine = bilinear(levels_[level], u, v);
    const float coarse = bilinear(levels_[level + 1], u, v);
    return fine + share * (coarse - fine);
  }

 private:
  struct Level {
    float scale;  // texels of this level a texel of level 0
    int mask;     // size - 1
    int shift;    // log2(size)
    std::vector<std::uint8_t> texels;
  };

  /**
   * At (x, y) in texels of level 0; texel (i, j) of a level covers [i, i + 1) x [j, j + 1) there.
   * Positions are rounded to 1/2048 of a texel and interpolated in integers.
   */
  static float bilinear(const Level& l, float x, float y) {
    constexpr int kBits = 11, kOne = 1 << kBits;
    const float scale = l.scale * kOne;
    const int fx = static_cast<int>(x * scale) - kOne / 2,
              fy = static_cast<int>(y * scale) - kOne / 2;
    const int wx = fx & (kOne - 1), wy = fy & (kOne - 1);
    const int x0 = fx >> kBits, y0 = fy >> kBits;
    const int i0 = x0 & l.mask, i1 = (x0 + 1) & l.mask;
    const std::uint8_t* row0 = l.texels.data() + (static_cast<size_t>(y0 & l.mask) << l.shift);
    const std::uint8_t* row1 =
        l.texels.data() + (static_cast<size_t>((y0 + 1) & l.mask) << l.shift);
    const int a = row0[i0], b = row0[i1], c = row1[i0], d = row1[i1];
    const int top = a * kOne + wx * (b - a), bottom = c * kOne + wx * (d - c);
    return static_cast<float>(top * kOne + wy * (bottom - top)) * (1.0f / (1 << (2 * kBits)));
  }

  std::vector<Level> levels_;
};

}  // namespace etalon
