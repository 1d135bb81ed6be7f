#include "etalon/imu/bias_prediction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kWide = 0.1;  // m/s^2
const Vector3d kDevice(-0.02, 0.13, 0.07);

Vector3d normal3(std::mt19937_64* generator) {
  std::normal_distribution<double> normal;
  Vector3d v;
  for (int a = 0; a < 3; ++a) v[a] = normal(*generator);
  return v;
}

/** Flights about kDevice. @param freedom of their t distribution; 0: normal */
std::vector<SensorBias> flights(int count, double scale, double error, int freedom,
                                std::mt19937_64* generator) {
  std::vector<SensorBias> result;
  for (int i = 0; i < count; ++i) {
    double stretch = 1.0;
    if (freedom > 0) {
      std::chi_squared_distribution<double> chi2(freedom);
      stretch = std::sqrt(freedom / chi2(*generator));
    }
    SensorBias flight;
    flight.mean = kDevice + scale * stretch * normal3(generator) + error * normal3(generator);
    flight.sigma.setConstant(error);
    result.push_back(flight);
  }
  return result;
}

TEST(BiasPrediction, WithoutFlightsBelievesWhatItIsTold) {
  const BiasPrediction none = predictBias({}, kWide);
  EXPECT_EQ(none.sigma, kWide);
  EXPECT_EQ(none.mean, Vector3d::Zero());
}

TEST(BiasPrediction, OneFlightTellsTheMeanAndNoSpread) {
  SensorBias flight;
  flight.mean = kDevice;
  flight.sigma.setConstant(0.002);
  const BiasPrediction one = predictBias({flight}, kWide);
  EXPECT_LT((one.mean - kDevice).norm(), 1e-9);
  EXPECT_EQ(one.sigma, kWide);
}

TEST(BiasPrediction, FlightsThatDifferByMoreThanIsBelievedWithoutThemAreBelieved) {
  for (const int count : {2, 5, 10}) {
    std::mt19937_64 generator(3);
    const BiasPrediction cheap = predictBias(flights(count, 0.3, 0.005, 0, &generator), kWide);
    EXPECT_GT(cheap.sigma, 0.3) << count;
    EXPECT_LT(cheap.sigma, 2.0) << count;
  }
}

TEST(BiasPrediction, ManyFlightsGiveTheirMeanAndSpread) {
  std::mt19937_64 generator(3);
  const BiasPrediction many = predictBias(flights(400, 0.01, 0.005, 4, &generator), kWide);
  // Standard error of the mean: 0.01 * sqrt(2) / 20 an axis, and less by weighting.
  EXPECT_LT((many.mean - kDevice).norm(), 0.002);
  EXPECT_NEAR(many.spread, 0.01, 0.001);  // 1200 values: 3 %, and the tails
  // Of a t distribution of four degrees of freedom 0.27 % are beyond 6.62.
  EXPECT_NEAR(many.sigma, 0.01 * 6.62 / 3.0, 0.0022);
}

/** Whatever the tails and however few the flights, the next one is where it is predicted; three
 * sigmas hold it all but always. Few flights hardly tell a spread: there the prediction is wide. */
TEST(BiasPrediction, TheNextFlightIsWhereItIsPredicted) {
  for (const int freedom : {0, 4}) {
    for (const int count : {3, 6}) {
      std::mt19937_64 generator(11);
      constexpr int kDevices = 150;
      double nees = 0.0;
      int within_two = 0, within_three = 0;
      for (int device = 0; device < kDevices; ++device) {
        const std::vector<SensorBias> known = flights(count, 0.01, 0.003, freedom, &generator);
        const Vector3d next = flights(1, 0.01, 0.0, freedom, &generator).front().mean;
        const BiasPrediction prediction = predictBias(known, kWide);
        const Vector3d d = (next - prediction.mean) / prediction.sigma;
        nees += d.squaredNorm() / 3.0 / kDevices;
        within_two += static_cast<int>((d.array().abs() < 2.0).count());
        within_three += static_cast<int>((d.array().abs() < 3.0).count());
      }
      SCOPED_TRACE("t of " + std::to_string(freedom) + ", " + std::to_string(count) + " flights");
      EXPECT_GT(nees, count == 3 ? 0.02 : 0.1);
      EXPECT_LT(nees, 1.0);
      EXPECT_GT(within_two / (3.0 * kDevices), 0.95);
      EXPECT_GT(within_three / (3.0 * kDevices), 0.99);  // 450 values: +- 0.25 %
    }
  }
}

TEST(BiasPrediction, AnOutlierMovesTheMeanLittleAndWidensTheSpread) {
  std::mt19937_64 generator(5);
  std::vector<SensorBias> known = flights(6, 0.005, 0.001, 0, &generator);
  const BiasPrediction without = predictBias(known, kWide);
  SensorBias outlier;
  outlier.mean = kDevice + Vector3d(0.0, 0.1, 0.0);
  outlier.sigma.setConstant(0.001);
  known.push_back(outlier);
  const BiasPrediction with = predictBias(known, kWide);
  EXPECT_LT((with.mean - without.mean).norm(), 0.004);  // the plain mean: 0.014
  EXPECT_GT(with.sigma, 1.2 * without.sigma);
}

TEST(BiasPrediction, AFlightThatIsHardlyKnownCountsLittle) {
  std::mt19937_64 generator(7);
  std::vector<SensorBias> known = flights(5, 0.005, 0.001, 0, &generator);
  const BiasPrediction without = predictBias(known, kWide);
  SensorBias vague;
  vague.mean = kDevice + Vector3d(0.1, 0.1, 0.1);
  vague.sigma.setConstant(0.1);
  known.push_back(vague);
  const BiasPrediction with = predictBias(known, kWide);
  EXPECT_LT((with.mean - without.mean).norm(), 0.001);
  EXPECT_NEAR(with.sigma / without.sigma, 1.0, 0.1);
}

TEST(BiasPrediction, WanderIsPartOfWhatIsPredicted) {
  std::mt19937_64 generator(7);
  std::vector<SensorBias> known = flights(6, 0.005, 0.001, 0, &generator);
  const double still = predictBias(known, kWide).sigma;
  for (SensorBias& flight : known) flight.wander = 0.02;
  const BiasPrediction prediction = predictBias(known, kWide);
  EXPECT_DOUBLE_EQ(prediction.wander, 0.02);
  EXPECT_NEAR(prediction.sigma, std::hypot(still, 0.02), 0.1 * prediction.sigma);
}

constexpr TimeNs kDay = 86'400 * kNanosecondsPerSecond;
constexpr TimeNs kSummer = 1'400'000'000 * kNanosecondsPerSecond;

TEST(BiasDrift, IsFoundWithItsError) {
  std::mt19937_64 generator(9);
  std::vector<SensorBias> known = flights(8, 0.001, 0.0, 0, &generator);
  std::vector<TimeNs> stamps;
  const Vector3d per_day(1e-3, 0.0, -2e-3);
  for (size_t i = 0; i < known.size(); ++i) {
    stamps.push_back(kSummer + static_cast<TimeNs>(i) * kDay);
    known[i].mean += static_cast<double>(i) * per_day;
  }
  const auto drift = biasDrift(known, stamps);
  ASSERT_TRUE(drift);
  EXPECT_DOUBLE_EQ(drift->days, 7.0);
  for (int a = 0; a < 3; ++a) {
    EXPECT_LT(std::abs(drift->per_day[a] - per_day[a]), 3.0 * drift->sigma[a]);
    EXPECT_LT(drift->sigma[a], 4e-4);  // 0.001 / sqrt(42), times two for chance
  }
}

TEST(BiasDrift, IsNotToldByFewFlightsOneDayOrNoDates) {
  std::mt19937_64 generator(9);
  const std::vector<SensorBias> known = flights(4, 0.001, 0.0, 0, &generator);
  EXPECT_TRUE(biasDrift(known, {kSummer, kSummer + kDay, kSummer + 2 * kDay, kSummer + 3 * kDay}));
  EXPECT_FALSE(biasDrift(known, {kSummer, kSummer + 1, kSummer + 2, kSummer + kDay}));
  EXPECT_FALSE(biasDrift(known, {0, kDay, 2 * kDay, 3 * kDay}));
  EXPECT_FALSE(biasDrift({known[0], known[1]}, {kSummer, kSummer + 5 * kDay}));
}

}  // namespace
}  // namespace etalon
