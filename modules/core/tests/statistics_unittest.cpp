#include "etalon/core/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace etalon {
namespace {

TEST(Statistics, MedianIsOneOfTheValues) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 3.0, 2.0}), 3.0);
  EXPECT_EQ(median({-7.0}), -7.0);
  EXPECT_TRUE(std::isnan(median({})));
}

TEST(Statistics, QuantileIsInterpolatedLinearly) {
  // R: quantile(c(1, 2, 4, 8, 16), c(0, 0.1, 0.5, 0.9, 1), type = 7): 1.0 1.4 4.0 12.8 16.0
  const std::vector<double> values = {16, 1, 8, 2, 4};
  EXPECT_EQ(quantile(values, 0.0), 1.0);
  EXPECT_NEAR(quantile(values, 0.1), 1.4, 1e-15);
  EXPECT_EQ(quantile(values, 0.5), 4.0);
  EXPECT_NEAR(quantile(values, 0.9), 12.8, 1e-14);
  EXPECT_EQ(quantile(values, 1.0), 16.0);
  EXPECT_EQ(quantile({3.0}, 0.9), 3.0);
  EXPECT_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Statistics, MeanUpToLeavesOutWhatIsLarger) {
  EXPECT_EQ(meanUpTo(4.0, {1.0, 100.0, 4.0}), 2.5);
  EXPECT_TRUE(std::isnan(meanUpTo(4.0, {})));
  EXPECT_TRUE(std::isnan(meanUpTo(0.5, {1.0})));
}

TEST(Statistics, QuantileNeverFallsAsItsShareGrows) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> values(37);
  for (double& value : values) value = uniform(generator);
  double before = quantile(values, 0.0);
  for (int i = 1; i <= 1000; ++i) {
    const double now = quantile(values, 1e-3 * i);
    ASSERT_GE(now, before) << i;
    before = now;
  }
}

TEST(Statistics, OfNaNThereIsNoOrder) {
  // Enough values that a sort which believes them ordered would leave the array.
  std::vector<double> values(1000, std::numeric_limits<double>::quiet_NaN());
  for (size_t i = 0; i < values.size(); i += 3) values[i] = static_cast<double>(i);
  EXPECT_TRUE(std::isnan(quantile(values, 0.5)));
  EXPECT_TRUE(std::isnan(median(values)));
}

TEST(ChiSquare, QuantileIsThatOfTheTables) {
  // Upper tails; Abramowitz and Stegun, table 26.8, to the digits printed there.
  const struct {
    double dof, tail, quantile;
  } cases[] = {{1, 0.1, 2.70554},    {1, 0.01, 6.63490},   {1, 0.001, 10.828},
               {3, 0.1, 6.25139},    {3, 0.01, 11.3449},   {3, 0.001, 16.266},
               {10, 0.01, 23.2093},  {100, 0.01, 135.807}, {100, 0.99, 70.0648},
               {2, 0.001, 13.81551}, {1, 0.05, 3.84146}};
  for (const auto& c : cases)
    EXPECT_NEAR(chiSquareQuantile(c.dof, c.tail), c.quantile, 5e-5 * c.quantile)
        << c.dof << " " << c.tail;
}

TEST(ChiSquare, QuantileOfTwoDegreesOfFreedomIsALogarithm) {
  for (const double tail : {1e-9, 1e-3, 0.2, 0.5, 0.999})
    EXPECT_NEAR(chiSquareQuantile(2.0, tail), -2.0 * std::log(tail), 1e-12 * -2.0 * std::log(tail));
  // Degrees of freedom need not be whole; it grows with them.
  EXPECT_GT(chiSquareQuantile(2.5, 0.01), chiSquareQuantile(2.0, 0.01));
  EXPECT_LT(chiSquareQuantile(2.5, 0.01), chiSquareQuantile(3.0, 0.01));
}

}  // namespace
}  // namespace etalon
