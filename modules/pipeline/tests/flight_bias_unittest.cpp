#include "etalon/pipeline/flight_bias.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace etalon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using namespace state_index;

const BiasPriors kPriors;  // 0.1 rad/s, 0.1 m/s^2

/** Frames at 20 Hz, of which the first second is stereo odometry's; the biases wander as a
 * first-order process of 0.02 m/s^2 and two seconds. */
std::vector<FrameEstimate> flight(double seconds, double sigma_accel = 0.006, unsigned seed = 1) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<FrameEstimate> frames;
  Eigen::Vector3d wander = Eigen::Vector3d::Zero();
  const double keeps = std::exp(-0.05 / 2.0), moves = 0.02 * std::sqrt(1.0 - keeps * keeps);
  for (int i = 0; i < static_cast<int>(20.0 * seconds); ++i) {
    FrameEstimate frame;
    frame.t = durationNs(0.05 * i);
    if (i >= 20) {
      frame.state = PipelineState::kInertial;
      for (int a = 0; a < 3; ++a) wander[a] = keeps * wander[a] + moves * normal(generator);
      frame.nav.bias.gyro << -0.002, 0.021, 0.076;
      frame.nav.bias.accel = Eigen::Vector3d(-0.02, 0.13, 0.07) + wander;
      // The first seconds are far off, and said to be.
      if (i < 100) frame.nav.bias.accel.setConstant(1.0);
      frame.pose_covariance.setIdentity();
      const double sigma = i < 100 ? 0.1 : sigma_accel;
      frame.motion_variance << 1, 1, 1, 1e-8, 1e-8, 1e-8, sigma * sigma, sigma * sigma,
          sigma * sigma;
    }
    frames.push_back(frame);
  }
  return frames;
}

TEST(FlightBias, AJumpOfTheClockIsNoTimeInWhichItSettled) {
  std::vector<FrameEstimate> frames = flight(20.0);  // settled from 11 s on
  for (FrameEstimate& frame : frames)
    if (frame.t > durationNs(19.0)) frame.t += durationNs(60.0);
  const auto bias = biasOfFlight(frames, kPriors);
  ASSERT_FALSE(bias);
  EXPECT_THAT(bias.error().reason, HasSubstr("settled for"));
}

TEST(FlightBias, IsTheMeanOfWhatIsSettled) {
  double nees = 0.0;
  constexpr int kFlights = 40;
  for (int seed = 0; seed < kFlights; ++seed) {
    const auto bias = biasOfFlight(flight(91.0, 0.006, seed), kPriors);
    ASSERT_TRUE(bias) << bias.error().reason;
    EXPECT_EQ(bias->first, durationNs(11.0));
    EXPECT_EQ(bias->last, durationNs(90.95));
    EXPECT_NEAR(bias->accel.wander, 0.02, 0.006);
    EXPECT_NEAR(bias->gyro.mean[2], 0.076, 1e-9);
    EXPECT_GT(bias->gyro.sigma.minCoeff(), 1e-5);  // no less than is claimed of ten batches
    const Eigen::Vector3d error = bias->accel.mean - Eigen::Vector3d(-0.02, 0.13, 0.07);
    nees += error.cwiseQuotient(bias->accel.sigma).squaredNorm() / 3.0 / kFlights;
  }
  // Nine degrees of freedom a batch-means variance: 9/7 on average, 120 values of it.
  EXPECT_GT(nees, 0.8);
  EXPECT_LT(nees, 2.0);
}

TEST(FlightBias, IsRefusedInWords) {
  EXPECT_THAT(biasOfFlight({}, kPriors).error().reason, HasSubstr("never ran"));
  const auto brief = biasOfFlight(flight(15.0), kPriors);
  ASSERT_FALSE(brief);
  EXPECT_THAT(brief.error().reason, HasSubstr("settled for 4.0 s, at least 10 s are wanted"));
  EXPECT_THAT(brief.error().reason, Not(HasSubstr("at best")));  // known well enough
  std::vector<FrameEstimate> lost = flight(60.0);
  lost[800].state = PipelineState::kLost;
  EXPECT_THAT(biasOfFlight(lost, kPriors).error().reason, HasSubstr("lost 39.0 s after its start"));
}

TEST(FlightBias, ThePriorsEchoIsNoMeasurement) {
  const auto echo = biasOfFlight(flight(60.0, 0.02), [] {
    BiasPriors device;
    device.sigma_accel_mps2 = 0.022;
    return device;
  }());
  ASSERT_FALSE(echo);
  EXPECT_EQ(echo.error().status, RefusalStatus::kTooFewKeyframes);
  EXPECT_THAT(echo.error().reason,
              HasSubstr("known to 0.02 m/s^2 at best, half of the prior's is 0.011"));
}

TEST(FlightBias, FramesWithoutImagesAreLeftOut) {
  std::vector<FrameEstimate> frames = flight(60.0);
  for (int i = 600; i < 700; ++i) {
    frames[i].state = PipelineState::kDeadReckoning;
    frames[i].nav.bias.accel.setConstant(7.0);
  }
  const auto bias = biasOfFlight(frames, kPriors);
  ASSERT_TRUE(bias);
  EXPECT_LT(bias->accel.mean.norm(), 0.2);
}

}  // namespace
}  // namespace etalon
