#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace etalon {

/** Scrambles 64 bits (the finaliser of SplitMix64, Steele, Lea and Flood 2014). */
inline std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/** Nearly normal (sum of four uniform numbers), mean 0, variance 1; a function of its argument
 * only. */
inline float nearlyNormal(std::uint64_t key) {
  const std::uint64_t bits = mixBits(key);
  const int sum = static_cast<int>((bits & 0xffff) + ((bits >> 16) & 0xffff) +
                                   ((bits >> 32) & 0xffff) + (bits >> 48));
  constexpr float kMean = 2.0f * 65535.0f;
  constexpr float kSigma = 37837.2f;  // sqrt(4 / 12) 2^16
  return (static_cast<float>(sum) - kMean) / kSigma;
}

/** Seeded random numbers (SplitMix64), the same on every platform up to libm's rounding. */
class Random {
 public:
  /** Different streams of one seed are independent of each other. */
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mixBits(mixBits(seed) ^ stream)) {}

  std::uint64_t bits() {
    const std::uint64_t value = mixBits(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return value;
  }
  /** In [0, 1). */
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  int uniformInt(int count) { return static_cast<int>(uniform() * count); }
  /** Standard normal, by Box and Muller. */
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(6.28318530717958647692 * uniform());
  }
  Eigen::Vector3d normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }
  Eigen::Vector3d direction() { return normal3().normalized(); }

 private:
  std::uint64_t state_;
};

/** What the random numbers of a simulation are for; one independent stream each. */
enum RandomStream : std::uint64_t {
  kMotionStream = 1,
  kBiasStream,
  kImuNoiseStream,
  kLandmarkStream,
  kTrackStream,
  kRoomStream,
  kTextureStream,
  kImageNoiseStream,
  kFaultStream,
};

}  // namespace etalon
