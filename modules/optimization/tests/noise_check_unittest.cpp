#include "etalon/optimization/noise_check.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "etalon/optimization/visual_inertial_ba.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** Standard deviations believed over the true ones. */
struct Belief {
  double gyro = 1.0, accel = 1.0, pixel = 1.0;
};

VisualInertialBaOptions leastSquares() {
  VisualInertialBaOptions ba;
  ba.iterations_per_round = 30;
  ba.huber_pixel = ba.huber_inertial = 1e9;
  ba.prior_sigma_accel_mps2 = ba.prior_sigma_gyro_rps = 10.0;
  return ba;
}

VisualInertialBaResult solve(const SyntheticWindowOptions& options, const Belief& belief,
                             const VisualInertialBaOptions& ba) {
  const SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
  const VisualWindow window = buildVisualWindow(synthetic.calibration, synthetic.keyframes(),
                                                options.sigma_px * belief.pixel);
  // The synthetic noise is white.
  ImuNoiseDensities noise = synthetic.calibration.imu.noise;
  noise.gyro_random_walk = noise.accel_random_walk = 1e-12;
  noise.gyro_noise_density *= options.gyro_noise_factor * belief.gyro;
  noise.accel_noise_density *= options.accel_noise_factor * belief.accel;
  std::vector<VisualInertialState> states;
  for (const KeyframeState& s : synthetic.truth) states.push_back({s.T_WB, s.v_WB});
  std::vector<Eigen::Vector3d> landmarks;
  for (const LandmarkId id : window.landmark_ids)
    landmarks.push_back(synthetic.landmarks[static_cast<size_t>(id)]);
  std::vector<Preintegration> preintegrations;
  for (size_t k = 1; k < states.size(); ++k)
    preintegrations.emplace_back(
        synthetic.imu.between(synthetic.truth[k - 1].t, synthetic.truth[k].t), options.bias, noise);
  return solveVisualInertialBa(window, preintegrations, states, synthetic.bias, landmarks,
                               std::vector<char>(landmarks.size(), 1), ba);
}

NoiseCheck monteCarlo(SyntheticWindowOptions options, const Belief& belief,
                      const VisualInertialBaOptions& ba, int runs) {
  NoiseCheck sum;
  for (int run = 0; run < runs; ++run) {
    options.seed = static_cast<unsigned>(9000 + run);
    options.motion = run % 2 == 0 ? testing::Motion::kAggressive : testing::Motion::kGentle;
    const VisualInertialBaResult result = solve(options, belief, ba);
    EXPECT_GT(result.covariance.rows(), 0) << result.message;
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

void expectNear(const ResidualGroup& group, double ratio, double slack) {
  // Three standard deviations of a chi-square; `slack` on top.
  EXPECT_GT(group.dof, 0.0);
  EXPECT_NEAR(group.chi2 / group.dof, ratio, ratio * (3.0 * std::sqrt(2.0 / group.dof) + slack));
}
void print(const char* what, const NoiseCheck& c) {
  std::printf("%s: gyro %.4f (%.0f) accel %.4f (%.0f) vision %.4f (%.0f)\n", what,
              c.gyro.chi2 / c.gyro.dof, c.gyro.dof, c.accel.chi2 / c.accel.dof, c.accel.dof,
              c.vision.chi2 / c.vision.dof, c.vision.dof);
}

void solvePrint(const NoiseCheck& c) {
  Eigen::Vector3d chi2(c.gyro.chi2, c.accel.chi2, c.vision.chi2);
  std::printf("   theta %.3f %.3f %.3f (\n", (c.coupling.inverse() * chi2)(0), (c.coupling.inverse() * chi2)(1), (c.coupling.inverse() * chi2)(2));
}
TEST(NoiseCheck, Explore) {
  VisualInertialBaOptions ba = leastSquares();
  auto run = [](const char* n, const SyntheticWindowOptions& o, Belief b, VisualInertialBaOptions ba, int k) { auto c = monteCarlo(o, b, ba, k); print(n, c); solvePrint(c);};
  run("ls 1", noisy(), {}, leastSquares(), 120);
  run("ls gyro.5", noisy(), {0.5, 1, 1}, leastSquares(), 60);
  run("ls acc.5", noisy(), {1, 0.5, 1}, leastSquares(), 60);
  run("ls px.5", noisy(), {1, 1, 0.5}, leastSquares(), 60);
  run("rob 1", noisy(), {}, {}, 120);
  run("rob .5", noisy(), {0.5, 0.5, 0.5}, {}, 60);
  run("rob 2", noisy(), {2, 2, 2}, {}, 60);
  run("rob acc 6", noisy(), {1, 1/6., 1}, {}, 60);
  SyntheticWindowOptions o = noisy();
  o.outlier_share = 0.05;
  run("rob 1 outl", o, {}, {}, 120);
}

}  // namespace
}  // namespace etalon
