#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "visual_inertial_case.h"

namespace etalon {
namespace {

using testing::SyntheticWindowOptions;

/** Of [tilt, v of the last keyframe, b_g, b_a]: errors against the covariance's own blocks. 11
 * degrees of freedom are estimated: the yaw of the first keyframe is fixed; its (tiny) gauge variance
 * stands in the covariance. */
constexpr double kEstimated = 11.0;
double nees(const VisualInertialCase& c, const VisualInertialBaResult& result) {
  const Eigen::Index n = result.states.size();
  Eigen::Matrix<double, 12, 1> e;
  e << logSO3(c.states[0].T_WB.R.transpose() * result.states[0].T_WB.R),
      result.states.back().v_WB - c.states.back().v_WB, result.bias.gyro, result.bias.accel;
  std::vector<Eigen::Index> index;
  for (int i = 0; i < 3; ++i) index.push_back(i);
  for (int i = 0; i < 3; ++i) index.push_back(9 * (n - 1) + 6 + i);
  for (int i = 0; i < 6; ++i) index.push_back(9 * n + i);
  const Eigen::MatrixXd P = result.covariance(index, index);
  return squaredMahalanobis(e, P);
}

/** Plain least squares on pixels that err each for itself. */
VisualInertialBaOptions leastSquares() {
  VisualInertialBaOptions ba;
  ba.rounds = 1;
  ba.iterations_per_round = 30;
  ba.chi2_pixel = ba.chi2_inertial = 1e6;
  ba.sigma_shared_deg = ba.sigma_turn_deg = 1e-4;
  return ba;
}

constexpr int kRuns = 60;
/** Half the 99 % band of the mean of the runs. */
const double kBand = 2.58 * std::sqrt(2.0 * kEstimated / kRuns);

VisualInertialCase noisyCase(int run, double sigma_px = 0.7) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.keyframes = 6;
  options.landmarks = 60;
  options.sigma_px = sigma_px;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.seed = static_cast<unsigned>(500 + run);
  VisualInertialCase c(options, options.sigma_px);
  c.priors.sigma_accel_mps2 = c.priors.sigma_gyro_rps = 10.0;
  return c;
}

TEST(VisualInertialConsistency, CovarianceIsConsistent) {
  double sum = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const VisualInertialCase c = noisyCase(run);
    const VisualInertialBaResult result = c.solve(leastSquares());
    ASSERT_GT(result.covariance.rows(), 0);
    sum += nees(c, result);
  }
  EXPECT_NEAR(sum / kRuns, kEstimated, kBand);
}

/** The last keyframe's position is what the pixels know best. */
TEST(VisualInertialConsistency, CovarianceKnowsWhatTheRelabellingCosts) {
  VisualInertialBaOptions ba = leastSquares();
  ba.chi2_pixel = kChi2Pixel;
  ba.least_pixel_share = 1.0;
  ba.rounds = 6;
  constexpr int kWindows = 400;
  double sum = 0.0;
  for (int run = 0; run < kWindows; ++run) {
    const VisualInertialCase c = noisyCase(run);
    const VisualInertialBaResult result = c.solve(ba);
    const Eigen::Index p = 9 * (static_cast<Eigen::Index>(result.states.size()) - 1) + 3;
    const Eigen::Vector3d e = result.states.back().T_WB.t - c.states.back().T_WB.t;
    sum += squaredMahalanobis(e, result.covariance.block<3, 3>(p, p));
  }
  // Its standard deviation is 0.041; by the inliers' number alone it is 1.12.
  EXPECT_NEAR(sum / (3.0 * kWindows), 1.0, 0.1);
}

/** A case whose accelerometer has a slow error, constant over an interval, that it does not believe
 * in.
 * @param jolt of 40 ms in the last interval, m/s^2 */
VisualInertialCase slowCase(int run, const SlowAcceleration& slow, double sigma_px = 0.7,
                            const Eigen::Vector3d& jolt = Eigen::Vector3d::Zero()) {
  VisualInertialCase c = noisyCase(run, sigma_px);
  const auto intervals = static_cast<Eigen::Index>(c.preintegrations.size());
  Eigen::MatrixXd correlation(intervals, intervals);
  for (Eigen::Index k = 0; k < intervals; ++k)
    for (Eigen::Index l = 0; l < intervals; ++l)
      correlation(k, l) = slow.correlation(c.preintegrations[k].dt() * static_cast<double>(k - l));
  const Eigen::MatrixXd root = correlation.llt().matrixL();
  std::mt19937 random(static_cast<unsigned>(run));
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd error =  // a row an interval
      slow.sigma_mps2 * root *
      Eigen::MatrixXd::NullaryExpr(intervals, 3, [&] { return normal(random); });
  for (Eigen::Index k = 0; k < intervals; ++k) {
    std::vector<ImuSample> samples =
        c.synthetic.imu.between(c.synthetic.truth[k].t, c.synthetic.truth[k + 1].t);
    for (ImuSample& sample : samples) sample.accel += error.row(k).transpose();
    if (k + 1 == intervals)
      for (size_t i = 20; i < 28; ++i) samples.at(i).accel += jolt;
    c.preintegrations[k] =
        Preintegration(samples, c.synthetic.bias, c.synthetic.calibration.imu.noise);
  }
  return c;
}

TEST(VisualInertialConsistency, ASlowErrorOfTheAccelerometerIsEstimatedBesideItsBias) {
  SlowAcceleration slow{0.1, 0.5};
  slow.spread = slow.white_spread = 0.0;
  double believed = 0.0, ignored = 0.0, off_believed = 0.0, off_ignored = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    VisualInertialCase c = slowCase(run, slow);
    const VisualInertialBaResult without = c.solve(leastSquares());
    c.priors.slow_accel = slow;
    const VisualInertialBaResult with = c.solve(leastSquares());
    believed += nees(c, with);
    ignored += nees(c, without);
    off_believed += (with.states.back().v_WB - c.states.back().v_WB).norm();
    off_ignored += (without.states.back().v_WB - c.states.back().v_WB).norm();
  }
  EXPECT_NEAR(believed / kRuns, kEstimated, kBand);
  EXPECT_GT(ignored / kRuns, 2.0 * kEstimated);
  EXPECT_LT(off_believed, 0.8 * off_ignored);
}

TEST(VisualInertialConsistency, TheSizeOfTheSlowErrorFollowsTheWindow) {
  // Believed a fifth of what it is.
  const SlowAcceleration truth{0.2, 0.5};
  SlowAcceleration believed{0.04, 0.5};
  VisualInertialBaOptions ba = leastSquares();
  ba.rounds = 5;
  double fixed = 0.0, followed = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    VisualInertialCase c = slowCase(run, truth);
    believed.spread = believed.white_spread = 0.0;
    c.priors.slow_accel = believed;
    fixed += nees(c, c.solve(ba));
    c.priors.slow_accel.spread = 2.0;
    followed += nees(c, c.solve(ba));
  }
  EXPECT_GT(fixed / kRuns, 2.0 * kEstimated);
  EXPECT_LT(followed, 0.7 * fixed);  // a window of six keyframes does not tell it well
}

/** A jolt that the accelerometer does not tell, 40 ms in the last interval. */
TEST(VisualInertialConsistency, AJoltIsFoundInItsInterval) {
  constexpr double kSharpPx = 0.05;
  const SlowAcceleration slow{0.04, 0.5};
  const Eigen::Vector3d jolt(1.2, -2.1, 3.0);
  VisualInertialBaOptions ba = leastSquares();
  ba.rounds = 3;
  double calm = 0.0, found = 0.0, taken_for_slow = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    VisualInertialCase c = slowCase(run, slow, kSharpPx);
    VisualInertialCase jolted = slowCase(run, slow, kSharpPx, jolt);
    c.priors.slow_accel = jolted.priors.slow_accel = slow;
    calm += nees(c, c.solve(ba));
    found += nees(jolted, jolted.solve(ba));
    jolted.priors.slow_accel.jolt_spread = 0.0;
    taken_for_slow += nees(jolted, jolted.solve(ba));
  }
  EXPECT_NEAR(calm / kRuns, kEstimated, 2.0 * kBand);
  EXPECT_LT(found, 0.6 * taken_for_slow);
}

}  // namespace
}  // namespace etalon
