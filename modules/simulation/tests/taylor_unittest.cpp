#include "taylor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace etalon {
namespace {

using Series = Taylor<5>;

/** Value at t0 + dt of the function whose series at t0 this is. */
double at(const Series& s, double dt) {
  double value = 0.0;
  for (size_t k = s.c.size(); k-- > 0;) value = value * dt + s.c[k];
  return value;
}

TEST(Taylor, ASinusoidsSeriesIsTheSinusoidNearby) {
  for (const double t : {-1.3, 0.0, 0.4, 7.0}) {
    const Series s = sinusoid<5>(1.7, 2.3, 0.6, t);
    for (const double dt : {-0.01, 0.02})
      // The first term left out: 1.7 (2.3 dt)^6 / 720 = 2.3e-11.
      EXPECT_NEAR(at(s, dt), 1.7 * std::sin(2.3 * (t + dt) + 0.6), 3e-11);
  }
}

TEST(Taylor, ProductsObeyLeibniz) {
  const Series f = sinusoid<5>(1.0, 1.5, 0.2, 0.7), g = sinusoid<5>(0.5, 3.0, -1.0, 0.7);
  const Series h = f * g;
  EXPECT_DOUBLE_EQ(h.value(), f.value() * g.value());
  EXPECT_DOUBLE_EQ(h.rate(), f.rate() * g.value() + f.value() * g.rate());
  for (size_t k = 0; k < h.c.size(); ++k) {
    double sum = 0.0;
    for (size_t j = 0; j <= k; ++j) sum += f.c[j] * g.c[k - j];
    EXPECT_NEAR(h.c[k], sum, 1e-14);
    EXPECT_NEAR((g * f).c[k], h.c[k], 1e-14);
    EXPECT_DOUBLE_EQ((f + g).c[k], f.c[k] + g.c[k]);
    EXPECT_DOUBLE_EQ((f * 2.0).c[k], 2.0 * f.c[k]);
  }
}

TEST(Taylor, TheStepIsSmoothAtBothEndsAndRisesBetween) {
  EXPECT_EQ(smoothStep<5>(1.0, 2.0, 0.99).value(), 0.0);
  EXPECT_EQ(smoothStep<5>(1.0, 2.0, 3.01).value(), 1.0);
  // Five derivatives vanish: u = 1e-4 inside of an end the step is off by 462 u^6, and its
  // coefficient of order k by what differentiating leaves, at order 5 462 * 6 u = 0.28 / 2^5.
  for (const double t : {1.0 + 2e-4, 3.0 - 2e-4}) {
    const Series s = smoothStep<5>(1.0, 2.0, t);
    EXPECT_NEAR(s.value(), t < 2.0 ? 0.0 : 1.0, 1e-12);
    for (size_t k = 1; k < s.c.size(); ++k) EXPECT_NEAR(s.c[k], 0.0, 0.01) << k;
  }
  EXPECT_NEAR(smoothStep<5>(1.0, 2.0, 2.0).value(), 0.5, 1e-14);
  double before = 0.0;
  for (int i = 1; i < 200; ++i) {
    const Series s = smoothStep<5>(1.0, 2.0, 1.0 + 0.01 * i);
    EXPECT_GT(s.value(), before);
    EXPECT_GT(s.rate(), 0.0);
    // Antisymmetric about the middle; the polynomial's terms are up to 3465, eps of them 8e-13.
    EXPECT_NEAR(s.value() + smoothStep<5>(1.0, 2.0, 3.0 - 0.01 * i).value(), 1.0, 1e-12);
    before = s.value();
  }
}

}  // namespace
}  // namespace etalon
