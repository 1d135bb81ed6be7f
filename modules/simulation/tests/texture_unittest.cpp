#include "texture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace etalon {
namespace {

constexpr float kTexel = Texture::kTexelSize;
constexpr float kPeriod = Texture::kSize * kTexel;  // m

/** Mean and variance of lookups over a grid of one period. */
struct Moments {
  double mean = 0.0, variance = 0.0;
};

Moments momentsOf(const Texture& texture, float footprint) {
  constexpr int kSide = 128;
  double sum = 0.0, sum2 = 0.0;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const float gray =
          texture.sample((static_cast<float>(i) + 0.3f) * kPeriod / kSide,
                         (static_cast<float>(j) + 0.7f) * kPeriod / kSide, footprint);
      sum += gray;
      sum2 += gray * gray;
    }
  const double mean = sum / (kSide * kSide);
  return {mean, sum2 / (kSide * kSide) - mean * mean};
}

class TextureOf : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  const Texture texture{1, GetParam()};
};

TEST_P(TextureOf, RepeatsInBothDirections) {
  for (const float footprint : {0.0f, 3.0f * kTexel, 100.0f * kTexel})
    for (const auto& [u, v] : {std::pair{0.1f, 0.2f}, std::pair{1.7f, 4.0f}}) {
      const float gray = texture.sample(u, v, footprint);
      // A float of some metres holds a position to 1e-6 m, 1/2500 of a texel.
      EXPECT_NEAR(texture.sample(u + kPeriod, v, footprint), gray, 0.5f);
      EXPECT_NEAR(texture.sample(u, v + kPeriod, footprint), gray, 0.5f);
    }
}

TEST_P(TextureOf, RunsLinearlyFromTexelToTexel) {
  // A texel's own gray stands in its middle.
  const float v = 10.5f * kTexel;
  for (int i = 20; i < 60; ++i) {
    const float left = texture.sample((static_cast<float>(i) + 0.5f) * kTexel, v, 0.0f);
    const float right = texture.sample((static_cast<float>(i) + 1.5f) * kTexel, v, 0.0f);
    const float between = texture.sample((static_cast<float>(i) + 1.0f) * kTexel, v, 0.0f);
    EXPECT_NEAR(between, 0.5f * (left + right), 0.2f);
    EXPECT_NEAR(left, std::round(left), 0.2f);  // 8-bit texels; positions to 1/2048 of one
  }
}

TEST_P(TextureOf, AWideFootprintIsTheMeanOfWhatItCovers) {
  const Moments fine = momentsOf(texture, 0.0f);
  // Contrast goes down with the footprint, brightness does not.
  double before = fine.variance;
  for (const float texels : {4.0f, 32.0f, 256.0f}) {
    const Moments wide = momentsOf(texture, texels * kTexel);
    EXPECT_NEAR(wide.mean, fine.mean, 2.0) << texels;
    EXPECT_LT(wide.variance, before) << texels;
    before = wide.variance;
  }
  // Beyond the coarsest level: 4 x 4 texels are left.
  EXPECT_NEAR(texture.sample(0.3f, 0.4f, 1e3f), fine.mean, 40.0);
}

TEST_P(TextureOf, FootprintsBetweenTwoLevelsAreBetweenTheirGrays) {
  for (int i = 0; i < 30; ++i) {
    const float u = 0.031f * static_cast<float>(i), v = 0.017f * static_cast<float>(i);
    const float fine = texture.sample(u, v, 4.0f * kTexel);
    const float coarse = texture.sample(u, v, 8.0f * kTexel);
    // Halfway in the footprint is halfway in the mipmap's share: 6 = 4 (1 + 0.5).
    EXPECT_NEAR(texture.sample(u, v, 6.0f * kTexel), 0.5f * (fine + coarse), 0.01f);
  }
}

TEST_P(TextureOf, HasContrastAtEveryScaleThatACameraSees) {
  // 2.5 mm to 16 cm a pixel: gray levels enough for corners.
  for (const float texels : {1.0f, 8.0f, 64.0f})
    EXPECT_GT(std::sqrt(momentsOf(texture, texels * kTexel).variance), 8.0) << texels;
}

INSTANTIATE_TEST_SUITE_P(, TextureOf, ::testing::Values(0, 1, 3));

TEST(Texture, SeedAndIndexDecide) {
  const Texture a(1, 0), same(1, 0), other_index(1, 2), other_seed(2, 0);
  int differ_index = 0, differ_seed = 0;
  for (int i = 0; i < 100; ++i) {
    const float u = 0.05f * static_cast<float>(i), v = 0.02f * static_cast<float>(i);
    EXPECT_EQ(a.sample(u, v, 0.0f), same.sample(u, v, 0.0f));
    differ_index += a.sample(u, v, 0.0f) != other_index.sample(u, v, 0.0f);
    differ_seed += a.sample(u, v, 0.0f) != other_seed.sample(u, v, 0.0f);
  }
  EXPECT_GT(differ_index, 90);
  EXPECT_GT(differ_seed, 90);
}

}  // namespace
}  // namespace etalon
