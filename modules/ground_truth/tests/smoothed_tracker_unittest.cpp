#include "smoothed_tracker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/ground_truth/smoothing.h"

namespace etalon::ground_truth {
namespace {

/** Late positions followed up to 0.8 Hz and a turned body followed up to 0.13 Hz, as in EuRoC. */
class SmoothedByTheImu : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    truth_ = new SmoothedTruth(smoothedTruth(tracker(), 2, 20.0));
    const auto result = smoothGroundTruth(truth_->recorded, truth_->imu, ImuNoiseDensities());
    ASSERT_TRUE(result) << result.error().reason;
    result_ = new GroundTruthSmoothing(*result);
  }
  static void TearDownTestSuite() {
    delete result_;
    delete truth_;
  }

  static SmoothedTracker tracker() {
    SmoothedTracker tracker;
    tracker.position_shift_s = -0.02;
    tracker.turn << 0.0, radians(0.23), radians(-0.84);
    tracker.rotation_hz = 0.13;
    return tracker;
  }

  static SmoothedTruth* truth_;
  static GroundTruthSmoothing* result_;
};
SmoothedTruth* SmoothedByTheImu::truth_ = nullptr;
GroundTruthSmoothing* SmoothedByTheImu::result_ = nullptr;

// Two standard errors each: what is true is within them in 95 of 100 flights.
void expectWithin(const Measured& measured, double truth) {
  EXPECT_LT(std::abs(measured.value - truth), 2.0 * measured.sigma)
      << measured.value << " +- " << measured.sigma << ", true " << truth;
}

TEST_F(SmoothedByTheImu, TimeShiftIsThatOfTheTracker) {
  const Measured& shift = result_->offset.position_shift_s;
  expectWithin(shift, tracker().position_shift_s);
  EXPECT_LT(shift.sigma, 0.5e-3);
  expectWithin(result_->offset.rotation_shift_s, 0.0);
}

TEST_F(SmoothedByTheImu, BandwidthsAreFound) {
  expectWithin(result_->position_bandwidth_hz, tracker().position_hz);
  expectWithin(result_->rotation_bandwidth_hz, tracker().rotation_hz);
  EXPECT_LT(result_->position_bandwidth_hz.sigma, 0.1);
  EXPECT_LT(result_->rotation_bandwidth_hz.sigma, 0.03);
}

TEST_F(SmoothedByTheImu, TurnIsThatOfTheTracker) {
  const Measured3& turn = result_->offset.turn_rad;
  for (int i = 0; i < 3; ++i) expectWithin({turn.value[i], turn.sigma[i]}, tracker().turn[i]);
  EXPECT_LT(turn.sigma.maxCoeff(), radians(0.1));
}

// Most of the motion is faster than the smoother followed.
TEST_F(SmoothedByTheImu, OneNumberForAllMotionIsTooSmall) {
  const BodyOffset& plain = result_->plain_offset;
  EXPECT_GT(plain.position_shift_s.value, 0.9 * tracker().position_shift_s);
  EXPECT_GT(plain.position_shift_s.value + 5.0 * plain.position_shift_s.sigma,
            tracker().position_shift_s);
  EXPECT_GT(plain.turn_rad.value.z(), 0.5 * tracker().turn.z());
}

TEST_F(SmoothedByTheImu, CorrectedOneHasNeitherDelayNorTurn) {
  ProfileOptions profile;
  profile.profile = MotionProfile::kAggressive;
  profile.seed = 2;
  profile.duration_s = 20.0;
  const ProfileTrajectory flight(profile);
  double corrected = 0.0, recorded = 0.0, turned = 0.0, turned_before = 0.0;
  for (const StampedState& row : truth_->recorded.states) {
    const auto better = result_->corrected.at(row.t);
    if (!better) continue;
    const SE3 T_WB = flight.at(row.t).T_WB;
    corrected += (better->T_WB.t - T_WB.t).squaredNorm();
    recorded += (row.T_WB.t - T_WB.t).squaredNorm();
    turned += logSO3(T_WB.R.transpose() * better->T_WB.R).squaredNorm();
    turned_before += logSO3(T_WB.R.transpose() * row.T_WB.R).squaredNorm();
  }
  EXPECT_LT(corrected, 0.04 * recorded);    // five times nearer
  EXPECT_LT(turned, 0.25 * turned_before);  // twice; the tilt is known to 0.1 deg only
}

// The generator is another program than the model's low pass: the two agree in the response.
TEST(SmoothedTracker, ResponseIsThatOfTheModel) {
  constexpr double kSampling = 0.05, kBandwidthHz = 0.8;
  const auto n = Eigen::Index{1200};
  const auto amplitude = [&](double hz, auto smooth) {
    Eigen::Matrix3Xd signal = Eigen::Matrix3Xd::Zero(3, n);
    for (Eigen::Index k = 0; k < n; ++k)
      signal(0, k) = std::sin(2.0 * M_PI * hz * kSampling * static_cast<double>(k));
    return smooth(signal).row(0).segment(400, 400).maxCoeff();
  };
  std::vector<StampedState> still;
  std::vector<ImuSample> imu;
  for (Eigen::Index k = 0; k < n; ++k) {
    const TimeNs t = durationNs(kSampling * static_cast<double>(k));
    still.emplace_back(t, SE3());
    imu.push_back({t, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)});
  }
  for (const double hz : {0.2, 0.8, 1.6}) {
    const double position = amplitude(hz, [&](const Eigen::Matrix3Xd& signal) {
      return smoothedPositions(signal, still, ImuBuffer(imu), {}, kBandwidthHz);
    });
    // The samples miss the crest of a sine of 1.6 Hz by up to 1 - cos(pi / 12.5) = 3 %.
    EXPECT_NEAR(position, 1.0 / (1.0 + std::pow(hz / kBandwidthHz, 4.0)), 0.02) << hz;
    const double rotation = amplitude(hz, [&](const Eigen::Matrix3Xd& signal) {
      return smoothedRotations(signal, kSampling, kBandwidthHz);
    });
    EXPECT_NEAR(rotation, 1.0 / (1.0 + std::pow(hz / kBandwidthHz, 2.0)), 0.02) << hz;
  }
}

}  // namespace
}  // namespace etalon::ground_truth
