#include "etalon/optimization/bundle/noise_check.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"
#include "etalon/testing/known_landmarks.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** Standard deviations believed over the true ones. */
struct Belief {
  double gyro = 1.0, accel = 1.0, pixel = 1.0;
  double shared_deg = 0.0;  ///< true: every keyframe's pixels are turned together, an axis
  double turn_deg = 0.0;    ///< true: all keyframes' pixels are turned alike, an axis
  double jolt_mps2 = 0.0;   ///< true: an error of the accelerometer's x in the third interval
};

/** The synthetic pixels of a frame err each for itself. */
constexpr double kNoSharedError = 1e-4;

VisualInertialBaOptions robust() {
  VisualInertialBaOptions ba;
  ba.check_noise = true;
  ba.least_pixel_share = 1.0;  // what is believed is judged
  ba.sigma_shared_deg = ba.sigma_turn_deg = kNoSharedError;
  return ba;
}

VisualInertialBaOptions leastSquares() {
  VisualInertialBaOptions ba = robust();
  ba.iterations_per_round = 30;
  ba.chi2_pixel = ba.chi2_inertial = 1e9;
  return ba;
}

/** Turns what each keyframe sees by a rotation of the body of its own and by one that all have in
 * common, both cameras alike. */
void turnKeyframes(const Belief& truth, unsigned seed, VisualWindow* window) {
  std::mt19937 rng(seed);
  const auto drawn = [&rng](double sigma_deg) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of twelve uniform numbers: variance 1
    for (int i = 0; i < 12; ++i)
      for (int a = 0; a < 3; ++a) sum[a] += static_cast<double>(rng()) / 4294967296.0 - 0.5;
    return Eigen::Vector3d(radians(sigma_deg) * sum);
  };
  std::vector<Eigen::Matrix3d> turn;
  for (int k = 0; k < window->keyframe_count; ++k) turn.push_back(expSO3(drawn(truth.shared_deg)));
  const Eigen::Matrix3d common = expSO3(drawn(truth.turn_deg));
  for (Eigen::Matrix3d& R : turn) R = common * R;
  for (VisualMeasurement& m : window->measurements) {
    const Eigen::Matrix3d& R_CB = window->T_CB[m.camera].R;
    const Eigen::Vector3d f =
        R_CB * turn[m.keyframe] * R_CB.transpose() * m.measurement.xy.homogeneous();
    m.measurement.xy = f.hnormalized();
  }
}

VisualInertialBaResult solve(const SyntheticWindowOptions& options, const Belief& belief,
                             const VisualInertialBaOptions& ba) {
  VisualInertialProblem problem;
  // Least squares are judged without priors.
  if (ba.chi2_pixel > 1e8) problem.priors.sigma_accel_mps2 = problem.priors.sigma_gyro_rps = 10.0;
  const SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
  VisualWindow window = buildVisualWindow(synthetic.calibration, synthetic.keyframes(),
                                          options.sigma_px * belief.pixel);
  if (belief.shared_deg > 0.0 || belief.turn_deg > 0.0)
    turnKeyframes(belief, options.seed, &window);
  // The synthetic noise is white.
  ImuNoiseDensities noise = synthetic.calibration.imu.noise;
  noise.gyro_random_walk = noise.accel_random_walk = 1e-12;
  noise.gyro_noise_density *= options.gyro_noise_factor * belief.gyro;
  noise.accel_noise_density *= options.accel_noise_factor * belief.accel;
  for (const StampedState& s : synthetic.truth) problem.states.push_back(s);
  for (size_t k = 1; k < problem.states.size(); ++k) {
    std::vector<ImuSample> samples =
        synthetic.imu.between(synthetic.truth[k - 1].t, synthetic.truth[k].t);
    if (k == 3)
      for (ImuSample& sample : samples) sample.accel.x() += belief.jolt_mps2;
    problem.preintegrations.emplace_back(std::move(samples), options.bias, noise);
  }
  problem.bias = synthetic.bias;
  problem.bundle = BundleProblem(std::move(window), testing::knownLandmarks(synthetic.landmarks));
  return solveVisualInertialBa(std::move(problem), ba);
}

NoiseCheck monteCarlo(SyntheticWindowOptions options, const Belief& belief,
                      const VisualInertialBaOptions& ba, int runs) {
  NoiseCheck sum;
  for (int run = 0; run < runs; ++run) {
    options.seed = static_cast<unsigned>(9000 + run);
    options.motion = run % 2 == 0 ? testing::Motion::kAggressive : testing::Motion::kGentle;
    const VisualInertialBaResult result = solve(options, belief, ba);
    EXPECT_GT(result.covariance.rows(), 0) << result.summary.message;
    sum += result.noise;
  }
  return sum;
}

SyntheticWindowOptions noisy() {
  SyntheticWindowOptions options;
  options.landmarks = 80;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = 1.5;
  options.accel_noise_factor = 6.0;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  return options;
}

/** chi2/dof is `ratio` within three of a chi-square's standard deviations and `slack`, relative. */
void expectRatio(const ResidualGroup& group, double ratio, double slack) {
  ASSERT_GT(group.dof, 0.0);
  EXPECT_NEAR(group.chi2 / group.dof, ratio, ratio * (3.0 * std::sqrt(2.0 / group.dof) + slack));
}

/**
 * Variance components, true over believed. A quarter is three standard errors of the gyro's, the
 * worst determined here; chi2/dof alone would give 1.4 (gyro) and 2.3 (accelerometer) for 4.
 */
void expectVariances(const NoiseCheck& check, const Eigen::Vector3d& expected) {
  const Eigen::Vector3d chi2(check.gyro.chi2, check.accel.chi2, check.vision.chi2);
  const Eigen::Vector3d variance = check.coupling.inverse() * chi2;
  EXPECT_NEAR(variance[0], expected[0], 0.25 * expected[0]);
  EXPECT_NEAR(variance[1], expected[1], 0.25 * expected[1]);
  EXPECT_NEAR(variance[2], expected[2], 0.02 * expected[2]);
}

constexpr int kRuns = 60;

TEST(NoiseCheck, IsOneIfTheNoiseIsBelievedRight) {
  const NoiseCheck check = monteCarlo(noisy(), {}, leastSquares(), kRuns);
  expectRatio(check.gyro, 1.0, 0.0);
  expectRatio(check.accel, 1.0, 0.0);
  expectRatio(check.vision, 1.0, 0.0);
  // What is expected is the sum of what the three noises give.
  const Eigen::Vector3d dof = check.coupling.rowwise().sum();
  EXPECT_NEAR(dof[0], check.gyro.dof, 1e-6 * dof[0]);
  EXPECT_NEAR(dof[1], check.accel.dof, 1e-6 * dof[1]);
  EXPECT_NEAR(dof[2], check.vision.dof, 1e-6 * dof[2]);
}

TEST(NoiseCheck, IsFourIfAllNoiseIsTwiceWhatIsBelieved) {
  const NoiseCheck check = monteCarlo(noisy(), {0.5, 0.5, 0.5}, leastSquares(), kRuns);
  expectRatio(check.gyro, 4.0, 0.0);
  expectRatio(check.accel, 4.0, 0.0);
  expectRatio(check.vision, 4.0, 0.0);
}

TEST(NoiseCheck, CouplingTellsWhichSensorIsBelievedWrong) {
  expectVariances(monteCarlo(noisy(), {0.5, 1, 1}, leastSquares(), kRuns), {4, 1, 1});
  expectVariances(monteCarlo(noisy(), {1, 0.5, 1}, leastSquares(), kRuns), {1, 4, 1});
  expectVariances(monteCarlo(noisy(), {1, 1, 0.5}, leastSquares(), kRuns), {1, 1, 4});
}

TEST(NoiseCheck, IsOneWithRobustLosses) {
  // 3 %: pixels truncated by the residuals of a fit are not quite a truncated Gaussian.
  const NoiseCheck check = monteCarlo(noisy(), {}, robust(), kRuns);
  expectRatio(check.gyro, 1.0, 0.03);
  expectRatio(check.accel, 1.0, 0.03);
  expectRatio(check.vision, 1.0, 0.03);
}

/** An error of the cameras is the gyro's noise to who does not believe in it, and no sensor's to
 * who does. 400 landmarks average out to nothing what is believed to be white, and overrule a gyro
 * that is right. */
void expectExplained(const Belief& truth, double VisualInertialBaOptions::*sigma_deg,
                     double true_sigma_deg) {
  SyntheticWindowOptions options = noisy();
  options.landmarks = 400;
  VisualInertialBaOptions ba = robust();
  const NoiseCheck unknown = monteCarlo(options, truth, ba, 4);
  EXPECT_GT(unknown.gyro.chi2, 2.0 * unknown.gyro.dof);
  ba.*sigma_deg = true_sigma_deg;
  const NoiseCheck known = monteCarlo(options, truth, ba, 4);
  expectRatio(known.gyro, 1.0, 0.03);
  expectRatio(known.accel, 1.0, 0.03);
  expectRatio(known.vision, 1.0, 0.03);
}

TEST(NoiseCheck, AnErrorThatTheFrameSharesIsNotTheGyros) {
  Belief truth;
  truth.shared_deg = 0.03;
  expectExplained(truth, &VisualInertialBaOptions::sigma_shared_deg, truth.shared_deg);
}

TEST(NoiseCheck, CamerasThatAreTurnedInTheBodyAreNotTheGyrosNoise) {
  Belief truth;
  truth.turn_deg = 0.5;
  expectExplained(truth, &VisualInertialBaOptions::sigma_turn_deg, truth.turn_deg);
}

TEST(NoiseCheck, OutliersDoNotBlowItUp) {
  SyntheticWindowOptions options = noisy();
  options.outlier_share = 0.05;  // moved by 5 to 50 px, that is 10 to 100 sigma
  const NoiseCheck check = monteCarlo(options, {}, robust(), kRuns);
  expectRatio(check.gyro, 1.0, 0.03);
  expectRatio(check.accel, 1.0, 0.03);
  // Each outlier counts as a residual at the threshold: 5.991 where 1.9 is expected.
  expectRatio(check.vision, 1.0 + 0.05 * (5.991 / 1.9 - 1.0), 0.06);
}

/** What Huber's loss bends to is what the check is to find. */
TEST(NoiseCheck, AnIntervalThatTheFitHardlyHeedsCountsWhole) {
  Belief belief;
  belief.jolt_mps2 = 1.0;
  const NoiseCheck check = monteCarlo(noisy(), belief, robust(), 4);
  EXPECT_GT(check.accel.chi2, 10.0 * check.accel.dof);
}

TEST(NoiseCheck, IsEmptyWithoutCovarianceAndWhereNobodyAsks) {
  for (const bool covariance : {false, true}) {
    VisualInertialBaOptions ba;
    ba.compute_covariance = covariance;
    ba.check_noise = !covariance;
    const VisualInertialBaResult result = solve(noisy(), {}, ba);
    EXPECT_EQ(result.covariance.size() > 0, covariance);
    EXPECT_EQ(result.noise.gyro.dof, 0.0);
    EXPECT_EQ(result.noise.vision.dof, 0.0);
  }
}

}  // namespace
}  // namespace etalon
