#include "etalon/core/chi_square.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

TEST(ChiSquare, NormalQuantileIsThatOfTheTables) {
  EXPECT_NEAR(normalQuantile(0.5), 0.0, 1e-12);
  EXPECT_NEAR(normalQuantile(0.005), 2.5758293035489, 1e-10);
  EXPECT_NEAR(normalQuantile(1e-3), 3.0902323061678, 1e-10);
  EXPECT_NEAR(normalQuantile(0.975), -1.9599639845401, 1e-10);
}

TEST(ChiSquare, QuantileIsThatOfTheTables) {
  // Upper tails; Abramowitz and Stegun, table 26.8.
  const struct {
    double dof, tail, quantile, relative;
  } cases[] = {{1, 0.1, 2.70554, 0.04},   {1, 0.01, 6.63490, 0.04},   {1, 0.001, 10.828, 0.04},
               {3, 0.1, 6.25139, 0.02},   {3, 0.01, 11.3449, 0.02},   {3, 0.001, 16.266, 0.02},
               {10, 0.01, 23.2093, 3e-3}, {100, 0.01, 135.807, 3e-4}, {100, 0.99, 70.0648, 3e-4}};
  for (const auto& c : cases)
    EXPECT_NEAR(chiSquareQuantile(c.dof, normalQuantile(c.tail)), c.quantile,
                c.relative * c.quantile)
        << c.dof << " " << c.tail;
}

}  // namespace
}  // namespace etalon
