#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "analytic_motion.h"
#include "etalon/core/symmetric.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Vector15d = Eigen::Matrix<double, 15, 1>;

constexpr TimeNs kMs = 1'000'000;

/**
 * All four noises matter in position and velocity of a quarter second; errors stay small enough for
 * first order.
 */
ImuNoiseDensities strongNoise() {
  ImuNoiseDensities noise;
  noise.gyro_noise_density = 3e-3;
  noise.gyro_random_walk = 1e-2;
  noise.accel_noise_density = 5e-3;
  noise.accel_random_walk = 3e-2;
  return noise;
}

/** Time that each sample stands for, s; an IMU's end samples have the noise of a whole step. */
std::vector<double> samplePeriods(const std::vector<ImuSample>& samples) {
  std::vector<double> steps;
  for (size_t k = 1; k < samples.size(); ++k)
    steps.push_back(secondsBetween(samples[k - 1].t, samples[k].t));
  std::vector<double> periods{steps.front()};
  for (size_t k = 1; k < steps.size(); ++k) periods.push_back(0.5 * (steps[k - 1] + steps[k]));
  periods.push_back(steps.back());
  return periods;
}

/** One noisy IMU: errors of its preintegration (truth minus estimate), and of the biases at the
 * end. */
Vector15d drawError(const std::vector<ImuSample>& truth, const Preintegration& exact,
                    const ImuNoiseDensities& noise, std::mt19937* random) {
  const std::vector<double> periods = samplePeriods(truth);
  std::vector<ImuSample> measured = truth;
  ImuBias bias;
  for (size_t k = 0; k < truth.size(); ++k) {
    if (k > 0) {
      const double root = std::sqrt(secondsBetween(truth[k - 1].t, truth[k].t));
      bias.gyro += gaussian(random, noise.gyro_random_walk * root);
      bias.accel += gaussian(random, noise.accel_random_walk * root);
    }
    const double root = std::sqrt(periods[k]);
    measured[k].gyro += bias.gyro + gaussian(random, noise.gyro_noise_density / root);
    measured[k].accel += bias.accel + gaussian(random, noise.accel_noise_density / root);
  }
  const Preintegration estimate(measured, {}, noise);
  Vector15d x;
  x << logSO3(estimate.deltas().dR.transpose() * exact.deltas().dR),
      exact.deltas().dp - estimate.deltas().dp, exact.deltas().dv - estimate.deltas().dv, bias.gyro,
      bias.accel;
  return x;
}

void expectConsistent(const std::vector<TimeNs>& stamps, double intensity, unsigned seed) {
  constexpr int kRuns = 1500;
  AnalyticMotion motion;
  motion.intensity = intensity;
  const std::vector<ImuSample> truth = motion.samples(stamps);
  const ImuNoiseDensities noise = strongNoise();
  const Preintegration exact(truth, {}, noise);
  const Eigen::LLT<Matrix15d> whole(exact.covariance());
  const Eigen::LLT<Eigen::Matrix<double, 9, 9>> navigation(exact.covariance9());
  ASSERT_EQ(whole.info(), Eigen::Success);
  ASSERT_EQ(navigation.info(), Eigen::Success);

  std::mt19937 random(seed);
  double nees15 = 0.0, nees9 = 0.0;
  Matrix15d whitened_covariance = Matrix15d::Zero();
  for (int run = 0; run < kRuns; ++run) {
    const Vector15d x = drawError(truth, exact, noise, &random);
    const Vector15d white = whole.matrixL().solve(x);
    whitened_covariance += white * white.transpose() / kRuns;
    nees15 += white.squaredNorm() / kRuns;
    nees9 += navigation.matrixL().solve(x.head<9>()).squaredNorm() / kRuns;
  }
  // 99 % bands of the mean of a chi-square variable over the runs (normal approximation).
  EXPECT_NEAR(nees9, 9.0, 2.576 * std::sqrt(2.0 * 9.0 / kRuns));
  EXPECT_NEAR(nees15, 15.0, 2.576 * std::sqrt(2.0 * 15.0 / kRuns));
  // And no block is too large at another's expense: 4.5 standard deviations for the worst of 120
  // entries, plus the 1/samples by which the ends of an interval differ.
  const double tolerance = 4.5 * std::sqrt(2.0 / kRuns) + 1.0 / static_cast<double>(stamps.size());
  EXPECT_LT((whitened_covariance - Matrix15d::Identity()).cwiseAbs().maxCoeff(), tolerance);
}

TEST(PreintegrationCovariance, AgreesWithMonteCarlo) {
  expectConsistent(evenStamps(317 * kMs, 5 * kMs, 50), 1.0, 11);
}

TEST(PreintegrationCovariance, AgreesWithMonteCarloOverALongInterval) {
  expectConsistent(evenStamps(317 * kMs, 5 * kMs, 200), 1.0, 12);
}

TEST(PreintegrationCovariance, AgreesWithMonteCarloForUnevenSteps) {
  expectConsistent(unevenStamps(317 * kMs, 2 * kMs, 120, 4), 1.0, 13);
}

TEST(PreintegrationCovariance, AgreesWithMonteCarloInFastRotation) {
  expectConsistent(evenStamps(317 * kMs, 5 * kMs, 50), 10.0, 14);
}

TEST(PreintegrationCovariance, IsTheClosedFormOfAFreeFall) {
  // No rotation, no specific force: the blocks decouple and their integrals are elementary.
  std::vector<ImuSample> samples;
  for (TimeNs t : evenStamps(0, 5 * kMs, 50)) {
    ImuSample sample;
    sample.t = t;
    samples.push_back(sample);
  }
  const ImuNoiseDensities n = strongNoise();
  const Preintegration p(samples, {}, n);
  const double T = p.dt();
  const auto P = [&](int i, int j) { return p.covariance()(i, j); };
  const double gyro2 = n.gyro_noise_density * n.gyro_noise_density;
  const double gyro_walk2 = n.gyro_random_walk * n.gyro_random_walk;
  const double accel2 = n.accel_noise_density * n.accel_noise_density;
  const double accel_walk2 = n.accel_random_walk * n.accel_random_walk;
  using namespace state_index;
  // The trapezoidal sum over 50 steps is 1/(2 50^2) = 2e-4 high for t^2, and up to 1e-3 for t^4.
  constexpr double kTrapezoid = 1e-3;
  for (int i = 0; i < 3; ++i) {
    const int r = kRotation + i, q = kPosition + i, v = kVelocity + i;
    const double rotation = gyro2 * T + gyro_walk2 * T * T * T / 3;
    EXPECT_NEAR(P(r, r), rotation, kTrapezoid * rotation);
    const double velocity = accel2 * T + accel_walk2 * T * T * T / 3;
    EXPECT_NEAR(P(v, v), velocity, kTrapezoid * velocity);
    const double position = accel2 * std::pow(T, 3) / 3 + accel_walk2 * std::pow(T, 5) / 20;
    EXPECT_NEAR(P(q, q), position, kTrapezoid * position);
    const double cross = accel2 * T * T / 2 + accel_walk2 * std::pow(T, 4) / 8;
    EXPECT_NEAR(P(q, v), cross, kTrapezoid * cross);
    EXPECT_NEAR(P(kGyroBias + i, kGyroBias + i), gyro_walk2 * T, 1e-12 * gyro_walk2);
    EXPECT_NEAR(P(kAccelBias + i, kAccelBias + i), accel_walk2 * T, 1e-12 * accel_walk2);
    EXPECT_NEAR(P(r, kGyroBias + i), -gyro_walk2 * T * T / 2, 1e-12 * gyro_walk2);
    EXPECT_NEAR(P(v, kAccelBias + i), -accel_walk2 * T * T / 2, 1e-12 * accel_walk2);
    EXPECT_NEAR(P(q, kAccelBias + i), -accel_walk2 * T * T * T / 6,
                kTrapezoid * accel_walk2 * T * T * T / 6);
    EXPECT_EQ(P(r, v), 0.0);
  }
}

TEST(PreintegrationCovariance, DependsOnTheDurationNotOnTheRate) {
  // Densities are continuous-time: five times the samples, the same uncertainty.
  const AnalyticMotion motion;
  const Preintegration slow(motion.samples(evenStamps(0, 5 * kMs, 50)), {}, strongNoise());
  const Preintegration fast(motion.samples(evenStamps(0, kMs, 250)), {}, strongNoise());
  const Matrix15d L_inverse =
      Eigen::LLT<Matrix15d>(fast.covariance()).matrixL().solve(Matrix15d(Matrix15d::Identity()));
  const Matrix15d ratio = L_inverse * slow.covariance() * L_inverse.transpose();
  EXPECT_LT((ratio - Matrix15d::Identity()).norm(), 0.02);  // O(1 / 50^2) in each direction
}

TEST(PreintegrationCovariance, IsSymmetricAndPositiveDefiniteEvenForOneTinyStep) {
  const AnalyticMotion motion;
  for (const auto& stamps :
       {evenStamps(0, 100'000, 1), evenStamps(0, 5 * kMs, 50), evenStamps(0, 5 * kMs, 2000)}) {
    const Preintegration p(motion.samples(stamps), {}, ImuNoiseDensities());
    EXPECT_EQ(p.covariance(), p.covariance().transpose());
    // Scaled to unit diagonal, as metres and radians differ by orders of magnitude.
    const Vector15d scale = p.covariance().diagonal().cwiseSqrt().cwiseInverse();
    const Matrix15d scaled = scale.asDiagonal() * p.covariance() * scale.asDiagonal();
    EXPECT_GT(symmetricEigenvalues(scaled)[0], 1e-6);
  }
}

}  // namespace
}  // namespace etalon
