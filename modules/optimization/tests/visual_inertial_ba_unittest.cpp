#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <iterator>
#include <map>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "visual_inertial_case.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

TEST(VisualInertialBa, IsExactOnExactDataFromAWrongStart) {
  for (const testing::Motion motion : {testing::Motion::kGentle, testing::Motion::kAggressive,
                                       testing::Motion::kCircle, testing::Motion::kPureRotation}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    VisualInertialCase c(options, 1.0);
    const Eigen::Matrix3d tilt = expSO3(Vector3d(0.02, -0.03, 0.0));
    for (NavState& s : c.states) {  // tilted world, wrong velocities and biases
      s.T_WB = SE3(tilt, Vector3d::Zero()) * s.T_WB;
      s.v_WB = tilt * s.v_WB + Vector3d(0.1, -0.1, 0.05);
    }
    for (Vector3d& p : c.landmarks) p = tilt * p;
    c.synthetic.bias = ImuBias();
    VisualInertialBaOptions ba;
    ba.rounds = 8;
    ba.iterations_per_round = 30;
    c.priors.sigma_gyro_rps = c.priors.sigma_accel_mps2 = 1e4;
    ba.reintegrate_gyro_rps = ba.reintegrate_accel_mps2 = 0.0;
    const VisualInertialBaResult result = c.solve(ba);
    c.synthetic.bias = options.bias;
    const testing::WindowErrors e = errorsOf(c.stamped(result), result.bias, c.synthetic);
    // Without noise what is left is where the solver stops.
    EXPECT_LT(e.rre_deg, 1e-4);
    EXPECT_LT(e.gravity_deg, 0.01);
    EXPECT_LT(e.gyro_bias_rps, 1e-5);
    EXPECT_LT(e.accel_bias_mps2, 1e-5);
    EXPECT_LT(e.ate_m, 1e-6);
    EXPECT_LT(e.velocity_mps, 1e-5);
  }
}

TEST(VisualInertialBa, PixelsAreAsNoisyAsTheyShowButNotMoreThanBelieved) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kGentle;
  options.sigma_px = 0.3;
  VisualInertialBaOptions ba;
  ba.sigma_shared_deg = ba.sigma_turn_deg = 1e-4;
  EXPECT_NEAR(VisualInertialCase(options, 1.0).solve(ba).pixel_share, 0.3, 0.03);
  EXPECT_EQ(VisualInertialCase(options, 0.2).solve(ba).pixel_share, 1.0);
  ba.least_pixel_share = 0.5;
  EXPECT_EQ(VisualInertialCase(options, 1.0).solve(ba).pixel_share, 0.5);
}

/** Starts from no bias at all, the truth being `bias`; the IMU is integrated there. */
VisualInertialCase unaware(SyntheticWindowOptions options, const ImuBias& bias) {
  options.bias = bias;
  VisualInertialCase c(options, 1.0);
  c.synthetic.bias = ImuBias();
  for (Preintegration& p : c.preintegrations) p = p.reintegrated(ImuBias());
  return c;
}

VisualInertialBaOptions patient() {
  VisualInertialBaOptions ba;
  ba.rounds = 8;
  ba.iterations_per_round = 30;
  return ba;
}

TEST(VisualInertialBa, AtRestThePriorDecidesOnTheLevelPartOfTheAccelerometerBias) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  const ImuBias truth{{0.0, 0.0, 0.0}, {0.2, -0.1, 0.15}};
  VisualInertialCase c = unaware(options, truth);
  VisualInertialBaOptions ba = patient();
  c.priors.mean.accel = Vector3d(-0.1, 0.25, 0.1);
  const VisualInertialBaResult result = c.solve(ba);
  // What is measured, f, is b_a and gravity of known size in any direction: of all b_a with
  // |f - b_a| = g the one next to the prior's mean.
  const Vector3d f =
      c.synthetic.imu.between(c.synthetic.truth[0].t, c.synthetic.truth[1].t)[0].accel;
  const Vector3d d = f - c.priors.mean.accel;
  const Vector3d expected = f - options.gravity_mps2 * d.normalized();
  EXPECT_GT((expected - truth.accel).norm(), 0.3);  // neither the truth nor the start
  EXPECT_GT(expected.norm(), 0.2);
  // The vertical is known to 1 mm/s^2 by the accelerometer's noise, the prior to 100: 1e-4 of 0.1.
  EXPECT_LT((result.bias.accel - expected).norm(), 1e-3);
  EXPECT_NEAR(sigmaTilt(result), c.priors.sigma_accel_mps2 / options.gravity_mps2, 1e-4);
}

TEST(VisualInertialBa, AtRestASlowErrorOfTheAccelerometerIsToldFromItsBiasByItsTime) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  VisualInertialCase c = unaware(options, {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.15}});
  const VisualInertialBaResult without = c.solve(patient());
  // So slow that it acts as b_a does, which at rest is tilt: both have their share by variance.
  c.priors.slow_accel = {0.05, 1e6};
  c.priors.slow_accel.spread = c.priors.slow_accel.white_spread = 0.0;
  const VisualInertialBaResult with = c.solve(patient());
  EXPECT_LT((with.bias.accel - without.bias.accel / 1.25).norm(), 1e-3);
  EXPECT_GT(without.bias.accel.norm(), 0.1);
  EXPECT_NEAR(sigmaTilt(with), std::hypot(c.priors.sigma_accel_mps2, 0.05) / options.gravity_mps2,
              1e-4);
  // Of half a second, it averages out in part over the window's 2.25 s.
  c.priors.slow_accel.time_s = 0.5;
  const VisualInertialBaResult half = c.solve(patient());
  EXPECT_GT(sigmaTilt(half), 1.01 * sigmaTilt(without));
  EXPECT_LT(sigmaTilt(half), 0.98 * sigmaTilt(with));
  // And the velocity is known worse than by white noise alone.
  EXPECT_GT(sigmaVelocity(half), sigmaVelocity(without));
}

TEST(VisualInertialBa, PriorWeighsAgainstTheDataByItsSigmas) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  VisualInertialCase c(options, 1.0);
  VisualInertialBaOptions ba = patient();
  ba.chi2_pixel = ba.chi2_inertial = 1e6;
  c.priors.sigma_gyro_rps = c.priors.sigma_accel_mps2 = 1e4;
  const VisualInertialBaResult data = c.solve(ba);
  const Eigen::Matrix<double, 6, 6> information =
      data.covariance.bottomRightCorner<6, 6>().ldlt().solve(Eigen::MatrixXd::Identity(6, 6));
  // About as certain as the data.
  c.priors.sigma_gyro_rps = std::sqrt(data.covariance.diagonal().tail<6>()[0]);
  c.priors.sigma_accel_mps2 = std::sqrt(data.covariance.diagonal().tail<6>()[4]);
  Eigen::Matrix<double, 6, 1> off, sigma;
  sigma << Vector3d::Constant(c.priors.sigma_gyro_rps),
      Vector3d::Constant(c.priors.sigma_accel_mps2);
  off << 1.0, -2.0, 1.5, -1.0, 2.0, 1.0;
  off = off.cwiseProduct(sigma).eval();
  c.priors.mean = {options.bias.gyro + off.head<3>(), options.bias.accel + off.tail<3>()};
  const VisualInertialBaResult both = c.solve(ba);
  Eigen::Matrix<double, 6, 1> moved;
  moved << both.bias.gyro - options.bias.gyro, both.bias.accel - options.bias.accel;
  const Eigen::Matrix<double, 6, 6> prior = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::Matrix<double, 6, 1> expected = (information + prior).ldlt().solve(prior * off);
  // In sigmas; to first order.
  EXPECT_LT((moved - expected).cwiseQuotient(sigma).norm(), 0.02) << moved.transpose() << "\n"
                                                                  << expected.transpose();
  EXPECT_GT(expected.cwiseQuotient(sigma).norm(), 0.5);
}

TEST(VisualInertialBa, IntegratesAnewWhereTheBiasesMovedFar) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const ImuBias truth{{0.2, -0.2, 0.2}, {0.1, -0.08, 0.12}};
  VisualInertialCase c = unaware(options, truth);
  VisualInertialBaOptions ba = patient();
  c.priors.sigma_gyro_rps = c.priors.sigma_accel_mps2 = 1e4;
  ba.chi2_inertial = 1e9;  // the first-order correction is far off in the first round
  const auto errors = [&] {
    const VisualInertialBaResult result = c.solve(ba);
    testing::SyntheticWindow synthetic = c.synthetic;
    synthetic.bias = truth;
    return errorsOf(c.stamped(result), result.bias, synthetic);
  };
  ba.reintegrate_gyro_rps = ba.reintegrate_accel_mps2 = 1e9;
  const testing::WindowErrors never = errors();
  ba.reintegrate_gyro_rps = 1e-4;
  const testing::WindowErrors anew = errors();
  // To first order the rotations are off by (|b_g| dt)^2 / 2 = 4 mrad.
  EXPECT_GT(never.gyro_bias_rps, 1e-5);
  EXPECT_GT(never.gravity_deg, 0.02);
  EXPECT_LT(anew.gyro_bias_rps, 1e-7);  // rounding and where the solver stops
  EXPECT_LT(anew.accel_bias_mps2, 1e-5);
  EXPECT_LT(anew.gravity_deg, 1e-4);
  EXPECT_LT(anew.velocity_mps, 1e-5);
}

TEST(VisualInertialBa, HuberBoundsWhatOneCorruptIntervalDoes) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  const auto velocityError = [&](double chi2_inertial, double blow) {
    VisualInertialCase c(options, options.sigma_px);
    std::vector<ImuSample> samples = c.preintegrations[4].samples();
    for (ImuSample& s : samples) s.accel += blow * Vector3d(0.8, -0.5, 0.3);
    c.preintegrations[4] = Preintegration(samples, options.bias, c.synthetic.calibration.imu.noise);
    VisualInertialBaOptions ba = patient();
    ba.chi2_inertial = chi2_inertial;
    // The synthetic pixels of a frame err each for itself.
    ba.sigma_shared_deg = ba.sigma_turn_deg = 1e-4;
    const VisualInertialBaResult result = c.solve(ba);
    return errorsOf(c.stamped(result), result.bias, c.synthetic).velocity_mps;
  };
  const double huber = VisualInertialBaOptions().chi2_inertial;
  const double small = velocityError(huber, 2.0), large = velocityError(huber, 4.0);
  const double squares = velocityError(1e12, 4.0);
  EXPECT_LT(large, 0.25 * squares);
  EXPECT_LT(large, 1.5 * small);  // without a bound it would be 2
}

/** Longest way of a state between two results, in the first one's standard deviations. */
double sigmasBetween(const VisualInertialBaResult& a, const VisualInertialBaResult& b) {
  const Eigen::Index n = 9 * a.states.size();
  Eigen::VectorXd e(n + 6);
  for (size_t k = 0; k < a.states.size(); ++k)
    e.segment<9>(9 * k) << logSO3(a.states[k].T_WB.R.transpose() * b.states[k].T_WB.R),
        b.states[k].T_WB.t - a.states[k].T_WB.t, b.states[k].v_WB - a.states[k].v_WB;
  e.tail<6>() << b.bias.gyro - a.bias.gyro, b.bias.accel - a.bias.accel;
  return std::sqrt(squaredMahalanobis(e, a.covariance));
}

TEST(VisualInertialBa, StopsWhereNoStateIsFarFromTheMinimumOrSaysThatItDidNot) {
  for (const testing::Motion motion : {testing::Motion::kStandstill, testing::Motion::kGentle}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.landmarks = 100;
    options.sigma_px = 0.5;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    VisualInertialCase c = unaware(options, {{0.02, -0.06, 0.04}, {0.05, -0.04, 0.03}});
    const Eigen::Matrix3d tilt = expSO3(Vector3d(0.15, -0.12, 0.0));  // 11 deg
    for (NavState& s : c.states) s.T_WB = SE3(tilt, Vector3d::Zero()) * s.T_WB;
    for (Vector3d& p_W : c.landmarks) p_W = tilt * p_W;
    VisualInertialBaOptions ba;
    ba.rounds = 1;
    ba.chi2_pixel = ba.chi2_inertial = 1e6;  // one minimum for all
    ba.reintegrate_gyro_rps = ba.reintegrate_accel_mps2 = 1e9;
    const VisualInertialBaResult usual = c.solve(ba);
    ba.converged_sigmas = 1e-3;
    const VisualInertialBaResult patient = c.solve(ba);
    ASSERT_TRUE(patient.summary.converged());
    EXPECT_TRUE(usual.summary.converged());
    EXPECT_LT(usual.last_step_sigmas, 0.1);
    EXPECT_LT(sigmasBetween(patient, usual), 0.1);
    ba.iterations_per_round = 1;
    const VisualInertialBaResult hasty = c.solve(ba);
    EXPECT_FALSE(hasty.summary.converged());
    EXPECT_GT(hasty.last_step_sigmas, 1.0);
    EXPECT_GT(sigmasBetween(patient, hasty), 0.1);
    EXPECT_TRUE(hasty.summary.message.empty()) << hasty.summary.message;  // it did not fail
  }
}

TEST(VisualInertialBa, ComesBackFromAWindowThatIsTiltedAsAWhole) {
  // Its pixels agree as well as at the truth, and are sharp: only a step that turns all of it
  // exactly lowers the cost.
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kGentle;
  options.sigma_px = 0.05;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  VisualInertialCase c(options, options.sigma_px);
  const VisualInertialBaResult expected = c.solve({});
  const Eigen::Matrix3d tilt = expSO3(Vector3d(0.4, -0.3, 0.0));  // 29 deg
  for (NavState& s : c.states) {
    s.T_WB = SE3(tilt, Vector3d::Zero()) * s.T_WB;
    s.v_WB = tilt * s.v_WB;
  }
  for (Vector3d& p_W : c.landmarks) p_W = tilt * p_W;
  const VisualInertialBaResult result = c.solve({});
  EXPECT_TRUE(result.summary.converged());
  EXPECT_LT(result.summary.iterations, 30);
  const auto vertical = [](const VisualInertialBaResult& r) {
    return Vector3d(r.states[0].T_WB.R.transpose() * Vector3d::UnitZ());
  };
  EXPECT_LT((vertical(result) - vertical(expected)).norm(), 0.1 * sigmaTilt(expected));
}

TEST(VisualInertialBa, SaysWhyWhenNothingAgrees) {
  SyntheticWindowOptions options;
  VisualInertialCase c(options, 1.0);
  for (Vector3d& p : c.landmarks) p += Vector3d(50, 0, 0);
  const VisualInertialBaResult result = c.solve({});
  EXPECT_EQ(result.summary.termination, Termination::kNotStarted);
  EXPECT_FALSE(result.summary.message.empty());
}

TEST(VisualInertialBa, CountsTheMeasurementsOfKnownLandmarksAlone) {
  SyntheticWindowOptions options;
  const VisualInertialCase c(options, 1.0);
  std::map<LandmarkId, Vector3d> known = testing::knownLandmarks(c.landmarks);
  for (auto at = known.begin(); at != known.end();)
    at = at->first % 3 == 0 ? std::next(at) : known.erase(at);
  int of_known = 0;
  for (const VisualMeasurement& m : c.window.measurements)
    of_known += known.count(c.window.landmark_ids[m.landmark]) > 0;
  const VisualInertialBaResult result =
      solveVisualInertialBa({BundleProblem(c.window, known), c.preintegrations, c.states,
                             c.synthetic.bias, c.priors, options.gravity_mps2});
  EXPECT_GT(of_known, 0);
  EXPECT_LT(2 * of_known, static_cast<int>(c.window.measurements.size()));
  EXPECT_EQ(result.measurements, of_known);
  EXPECT_EQ(result.inlier_measurements, of_known);  // there is no noise
}

}  // namespace
}  // namespace etalon
