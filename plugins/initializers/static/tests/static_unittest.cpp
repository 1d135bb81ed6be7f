#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <string>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::Motion;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

SyntheticWindowOptions atRest() {
  SyntheticWindowOptions options;
  options.motion = Motion::kStandstill;
  options.bias.gyro = {0.02, -0.06, 0.04};
  return options;
}

/** Shakes the IMU as running motors do: 90 Hz, zero mean over the window. */
void shake(double gyro_rps, double accel_mps2, SyntheticWindow* window) {
  std::vector<ImuSample> samples = window->imu.samples();
  for (ImuSample& s : samples) {
    const double t = secondsBetween(samples.front().t, s.t);
    s.gyro += gyro_rps * std::sin(2.0 * M_PI * 90.0 * t) * Vector3d(1, -1, 1);
    s.accel += accel_mps2 * std::sin(2.0 * M_PI * 90.0 * t + 1.0) * Vector3d(1, 1, -1);
  }
  window->imu = ImuBuffer(samples);
}

TEST(Static, IsExactAtRestWithoutNoise) {
  const SyntheticWindowOptions options = atRest();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  const InitializationResult result = load()->initialize(problem);
  ASSERT_TRUE(result) << result.error().reason;
  EXPECT_FALSE(problem.visualSolutionComputed());
  const WindowErrors e = errorsOf(result->states, result->bias, window);
  EXPECT_LT(e.gravity_deg, 1e-9);
  EXPECT_LT(e.gyro_bias_rps, 1e-12);
  EXPECT_LT(e.velocity_mps, 1e-12);
  EXPECT_LT(e.rre_deg, 1e-9);
  EXPECT_EQ(result->bias.accel, Vector3d::Zero());
}

TEST(Static, SubtractsTheAccelerometerBiasThatThePriorKnows) {
  SyntheticWindowOptions options = atRest();
  options.bias.accel = options.priors.mean.accel = {0.2, -0.3, 0.1};
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult result = load()->initialize(makeProblem(window, options));
  ASSERT_TRUE(result) << result.error().reason;
  EXPECT_LT(errorsOf(result->states, result->bias, window).gravity_deg, 1e-9);
  EXPECT_EQ(result->bias.accel, options.bias.accel);
}

TEST(Static, StandsStillWithRunningMotors) {
  SyntheticWindowOptions options = atRest();
  options.sigma_px = options.assumed_sigma_px = 0.3;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  shake(0.08, 1.4, &window);
  const InitializationResult result = load()->initialize(makeProblem(window, options));
  ASSERT_TRUE(result) << result.error().reason;
  const WindowErrors e = errorsOf(result->states, result->bias, window);
  EXPECT_LT(e.gravity_deg, 0.1);  // the shaking does not cancel exactly over the window
  EXPECT_LT(e.gyro_bias_rps, 1e-3);
}

TEST(Static, RefusesEveryMotionByTheImages) {
  for (const Motion motion : {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                              Motion::kPureRotation, Motion::kConstantVelocity}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options = atRest();
    options.motion = motion;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = load()->initialize(makeProblem(window, options));
    EXPECT_EQ(result.error().status, RefusalStatus::kTooMuchMotion);
    EXPECT_NE(result.error().reason.find("moves"), std::string::npos) << result.error().reason;
    EXPECT_GT(*result.error().value, 0.0);
  }
}

TEST(Static, RefusesByTheImuWhatTheImagesDoNotSee) {
  const SyntheticWindowOptions options = atRest();
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  shake(0.3, 0.0, &window);
  const InitializationResult rates = load()->initialize(makeProblem(window, options));
  EXPECT_EQ(rates.error().status, RefusalStatus::kTooMuchMotion);
  EXPECT_NEAR(*rates.error().value, 0.3 / std::sqrt(2.0), 0.01) << rates.error().reason;
  window = testing::makeSyntheticWindow(options);
  shake(0.0, 4.0, &window);
  const InitializationResult forces = load()->initialize(makeProblem(window, options));
  EXPECT_EQ(forces.error().status, RefusalStatus::kTooMuchMotion);
  EXPECT_NEAR(*forces.error().value, 4.0 / std::sqrt(2.0), 0.1) << forces.error().reason;
}

TEST(Static, RefusesTracksThatBreakOffWithinTheWindow) {
  const SyntheticWindowOptions options = atRest();
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (size_t k = 20; k < window.frames.size(); ++k) window.frames[k].observations.resize(5);
  const InitializationResult result = runOn(window, options, *load()).result;
  testing::expectRefusal(result, RefusalStatus::kTooMuchMotion, "are left");
  EXPECT_EQ(*result.error().value, 5.0);
}

TEST(Static, RefusesAMeanRateThatIsNoBias) {
  SyntheticWindowOptions options = atRest();
  options.bias.gyro = {0.0, 0.4, 0.0};
  const InitializationResult result = runOn(options, *load()).result;
  testing::expectRefusal(result, RefusalStatus::kImplausible, "mean rate");
  EXPECT_NEAR(*result.error().value, 0.4, 1e-9);
}

TEST(Static, AnUnknownAccelerometerBiasTiltsGravity) {
  SyntheticWindowOptions options = atRest();
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  // Level means orthogonal to what the accelerometer measures at rest.
  const Vector3d level = window.imu.samples().front().accel.unitOrthogonal();
  options.bias.accel = 0.2 * level;
  const testing::Outcome o = runOn(options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_NEAR(o.errors.gravity_deg, 180.0 / M_PI * std::atan(0.2 / 9.81), 1e-6);
}

TEST(Static, GivesTheSameResultBitForBit) {
  SyntheticWindowOptions options = atRest();
  options.sigma_px = 0.3;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  testing::expectSameBits([] { return load(); }, options);
}

TEST(Static, RefusesAnImuGapAndNonFiniteMeasurements) {
  testing::expectRefusesBrokenInput(*load());
}

TEST(Static, RefusesImplausibleMeansAndTooFewTracks) {
  SyntheticWindowOptions options = atRest();
  options.bias.accel = {0.0, 0.0, 0.0};
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& s : samples) s.accel *= 1.1;
  SyntheticWindow heavy = window;
  heavy.imu = ImuBuffer(samples);
  const InitializationResult gravity = load()->initialize(makeProblem(heavy, options));
  EXPECT_EQ(gravity.error().status, RefusalStatus::kImplausible);
  EXPECT_NEAR(*gravity.error().value, 0.981, 1e-6) << gravity.error().reason;

  for (TrackedFrame& frame : window.frames) frame.observations.resize(5);
  const InitializationResult tracks = load()->initialize(makeProblem(window, options));
  EXPECT_EQ(tracks.error().status, RefusalStatus::kTooFewTracks);
  EXPECT_EQ(*tracks.error().value, 5.0);
}

/** Error, truth against estimate, in the order of the covariance, without the velocity. */
Eigen::Matrix<double, 8, 1> errorOf(const InitializationResult& result,
                                    const SyntheticWindow& window) {
  Eigen::Matrix<double, 8, 1> e;
  e.head<3>() = window.bias.gyro - result->bias.gyro;
  e.segment<3>(3) = window.bias.accel - result->bias.accel;
  // R true = Exp(tilt) R up to yaw, so R^T z true, seen in the estimated world, is z - tilt x z.
  const Vector3d up =
      result->states.front().T_WB.R * window.truth.front().T_WB.R.transpose() * Vector3d::UnitZ();
  e(6) = up.y();
  e(7) = -up.x();
  return e;
}

TEST(Static, CovarianceIsHonestByMonteCarlo) {
  constexpr int kTrials = 400;
  const Initializer::Ptr initializer = load();
  std::mt19937 rng(7);
  std::normal_distribution<double> normal;
  double nees = 0.0, tilt_nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    SyntheticWindowOptions options = atRest();
    options.seed = static_cast<unsigned>(trial) + 1;
    options.keyframes = 3;
    options.frames_per_keyframe = 1;
    options.landmarks = 60;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    for (int a = 0; a < 3; ++a)
      options.bias.accel[a] = options.priors.sigma_accel_mps2 * normal(rng);
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = initializer->initialize(makeProblem(window, options));
    ASSERT_TRUE(result) << result.error().reason;
    ASSERT_EQ(result->covariance.rows(), 11);
    const Eigen::Matrix<double, 8, 1> e = errorOf(result, window);
    const Eigen::MatrixXd P = result->covariance.topLeftCorner(8, 8);
    nees += squaredMahalanobis(e, P) / kTrials;
    tilt_nees += squaredMahalanobis(e.tail<2>(), P.bottomRightCorner(2, 2)) / kTrials;
  }
  // Mean of chi-square with 8 and with 2 degrees of freedom; four standard deviations of the mean,
  // and one percent more for the tilt's second order (0.01 rad of tilt against 1).
  EXPECT_NEAR(nees, 8.0, 4.0 * std::sqrt(2.0 * 8.0 / kTrials) + 0.08);
  EXPECT_NEAR(tilt_nees, 2.0, 4.0 * std::sqrt(2.0 * 2.0 / kTrials) + 0.02);
}

TEST(Static, CovarianceSaysThatTiltAndAccelerometerBiasAreOneError) {
  SyntheticWindowOptions options = atRest();
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult result = load()->initialize(makeProblem(window, options));
  ASSERT_TRUE(result) << result.error().reason;
  const Eigen::MatrixXd& P = result->covariance;
  EXPECT_NEAR(std::sqrt(P(6, 6)), 0.1 / 9.81, 1e-4);
  // With a known b_a the tilt would be uncertain by the accelerometer's noise alone.
  const Eigen::Matrix2d given = P.block<2, 2>(6, 6) - P.block<2, 3>(6, 3) *
                                                          P.block<3, 3>(3, 3).inverse() *
                                                          P.block<3, 2>(3, 6);
  EXPECT_LT(std::sqrt(given(0, 0)), 0.02 * std::sqrt(P(6, 6)));
}

/**
 * At rest, then as if the body had turned at the constant rate `w` (rad/s, in the left camera) over
 * the window: so slowly that it passes for standstill. What gravity says of it is left out.
 */
SyntheticWindow turning(const SyntheticWindowOptions& options, const Vector3d& w) {
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  const CameraCalibration& camera = window.calibration.cameras[0];
  const TimeNs start = window.frames.front().t;
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) {
      const Vector3d ray = *camera.model.unproject(o.left);
      const Vector3d seen = expSO3(-secondsBetween(start, frame.t) * w) * ray;
      o.left = camera.model.project(seen).value_or(o.left);
    }
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& s : samples) s.gyro += camera.T_BC.R * w;
  window.imu = ImuBuffer(samples);
  return window;
}

/** Standard deviation of the b_g that is claimed, an axis, rad/s. */
double sigmaGyro(const InitializationResult& result) { return std::sqrt(result->covariance(0, 0)); }

TEST(Static, ATurnThatPassesForStandstillIsInTheCovarianceOfTheGyroBias) {
  SyntheticWindowOptions options = atRest();
  options.sigma_px = 0.2;
  options.gyro_noise_factor = 1.0;
  // 3 px over the window's 2.25 s, about each axis of the camera; about its own axis the median
  // landmark moves by less for the same angle.
  const double rate = 3.0 / 458.0 / 2.25;
  for (const Vector3d& w : {Vector3d(rate, 0, 0), Vector3d(0, -rate, 0), Vector3d(0, 0, rate),
                            Vector3d(0, 0, -2.0 * rate)}) {
    const SyntheticWindow window = turning(options, w);
    const InitializationResult result = load()->initialize(makeProblem(window, options));
    ASSERT_TRUE(result) << result.error().reason;
    EXPECT_NEAR((result->bias.gyro - options.bias.gyro).norm(), w.norm(), 0.2 * rate);
    // 250 landmarks with 0.3 px of displacement noise: 0.02 px, about the optical axis several times
    // that.
    EXPECT_NEAR(sigmaGyro(result), w.norm(), 0.05 * w.norm());
  }
}

TEST(Static, ThePixelsNoiseIsNoTurn) {
  constexpr int kTrials = 100;
  double nees = 0.0;
  for (unsigned seed = 1; seed <= kTrials; ++seed) {
    SyntheticWindowOptions options = atRest();
    options.seed = seed;
    options.keyframes = 4;
    options.frames_per_keyframe = 1;
    options.landmarks = 60;
    options.sigma_px = 0.5;
    options.gyro_noise_factor = 1.0;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = load()->initialize(makeProblem(window, options));
    ASSERT_TRUE(result) << result.error().reason;
    const Vector3d e = result->bias.gyro - window.bias.gyro;
    nees += squaredMahalanobis(e, result->covariance.topLeftCorner<3, 3>()) / kTrials;
  }
  // Mean of chi-square with three degrees of freedom, four standard deviations of the mean; one
  // window in a hundred is believed to turn, and claims less.
  EXPECT_NEAR(nees, 3.0, 4.0 * std::sqrt(2.0 * 3.0 / kTrials) + 0.05);
}

TEST(Static, TimeIsThatOfTheKeyframesWhateverTheNominalRate) {
  const SyntheticWindowOptions options = atRest();
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  const double expected = std::sqrt(makeProblem(window, options).imuNoise().gyro_noise_density *
                                    makeProblem(window, options).imuNoise().gyro_noise_density /
                                    2.25);  // ten keyframes at 4 Hz
  for (const double rate_hz : {100.0, 200.0, 400.0}) {
    window.calibration.imu.rate_hz = rate_hz;
    const InitializationResult result = load()->initialize(makeProblem(window, options));
    ASSERT_TRUE(result) << result.error().reason;
    EXPECT_NEAR(sigmaGyro(result), expected, 1e-9 * expected);  // rounding
  }
}

}  // namespace
}  // namespace etalon
