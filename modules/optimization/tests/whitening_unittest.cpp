#include <gtest/gtest.h>

#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/optimization/bundle/pose_only.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "etalon/testing/consistency.h"
#include "etalon/testing/noisy_window.h"

// Every place that whitens by a covariance, against the noise itself: simulated noise, and statistics
// of what comes out.

namespace etalon::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(Whitening, PreintegrationResidualAtTheTruthIsWhite) {
  WhiteSample sample;
  for (int run = 0; run < 60; ++run) {
    const NoisyWindow w(imuOnly(run));
    for (size_t k = 0; k < w.preintegrations.size(); ++k)
      sample.add(sqrtInformation(w.preintegrations[k]) *
                 preintegrationResidual(w.preintegrations[k], w.T_VB[k], w.v_VB[k], w.T_VB[k + 1],
                                        w.v_VB[k + 1], w.bias, w.g_V));
  }
  expectWhite(sample);
}

TEST(Whitening, ReprojectionResidualAtTheTruthIsWhite) {
  WhiteSample sample;
  for (int run = 0; run < 4; ++run) {
    const NoisyWindow w(withTracks(run, 0.7, 60));
    const VisualWindow window = w.visual(0.7);
    const std::vector<Vector3d> landmarks = w.landmarksOf(window);
    for (const VisualMeasurement& m : window.measurements) {
      Vector2d r;
      ASSERT_TRUE(reprojectionResidual(window.T_CB[m.camera], m.measurement, w.T_VB[m.keyframe],
                                       landmarks[m.landmark], &r));
      sample.add(r);
    }
  }
  EXPECT_GT(sample.count, 1000);
  expectWhite(sample);
}

TEST(Whitening, VisualInertialBaIsConsistentInAllItsStates) {
  std::mt19937 random(7);
  ChiSquare errors;
  for (int run = 0; run < 25; ++run) {
    SyntheticWindowOptions options = withTracks(run, 0.7, 60);
    options.keyframes = 5;
    const NoisyWindow w(options);
    VisualInertialProblem problem;
    problem.bundle = BundleProblem(w.visual(0.7), testing::knownLandmarks(w.synthetic.landmarks));
    for (const StampedState& s : w.synthetic.truth) problem.states.push_back(s);
    problem.preintegrations = w.preintegrations;
    problem.bias = w.bias;
    // Biases known well enough for the tilt to be small: rotating the window by more than some
    // mrad bends the errors of the later positions, which a covariance cannot say.
    problem.priors.sigma_gyro_rps = problem.priors.sigma_accel_mps2 = 0.01;
    problem.priors.mean = {w.bias.gyro + 0.01 * drawn(3, &random),
                           w.bias.accel + 0.01 * drawn(3, &random)};
    VisualInertialBaOptions ba;
    ba.rounds = 1;
    ba.iterations_per_round = 30;
    ba.chi2_pixel = ba.chi2_inertial = 1e6;  // plain least squares
    const VisualInertialBaResult result = solveVisualInertialBa(problem, ba);
    const std::vector<NavState>& states = problem.states;
    const Index n = states.size();
    ASSERT_EQ(result.covariance.rows(), 9 * n + 6);
    VectorXd e(9 * n + 6);
    for (size_t k = 0; k < states.size(); ++k)
      e.segment<9>(9 * k) << logSO3(states[k].T_WB.R.transpose() * result.states[k].T_WB.R),
          result.states[k].T_WB.t - states[k].T_WB.t, result.states[k].v_WB - states[k].v_WB;
    e.tail<6>() << result.bias.gyro - w.bias.gyro, result.bias.accel - w.bias.accel;
    // Position and yaw of the first keyframe are held at the truth.
    errors.add(squaredMahalanobis(e, result.covariance), static_cast<double>(e.size() - 4));
  }
  expectConsistent(errors);
}

TEST(Whitening, PoseOnlyCostsWhatItsFreedomSaysAndWhatTheRawPixelsSay) {
  ChiSquare whitened, raw;
  for (int run = 0; run < 10; ++run) {
    const NoisyWindow w(withTracks(run, 0.7, 60));
    const VisualWindow window = w.visual(0.7);
    const std::vector<Vector3d> landmarks = w.landmarksOf(window);
    PoseOnlyOptions options;
    options.chi2_threshold = 1e6;
    for (int k = 0; k < window.keyframe_count; k += 3) {
      std::vector<PointMeasurement> points;
      for (const VisualMeasurement& m : window.measurements)
        if (m.keyframe == k) points.push_back({landmarks[m.landmark], m.camera, m.measurement});
      const PoseOnlyResult result = solvePoseOnly(window.T_CB, points, w.T_VB[k], options);
      ASSERT_TRUE(result.summary.usable());
      double sum = 0.0, pixels = 0.0;
      for (const PointMeasurement& p : points) {
        const size_t c = p.camera;
        Vector2d r;
        ASSERT_TRUE(reprojectionResidual(window.T_CB[c], p.measurement, result.T_WB, p.p_W, &r));
        sum += r.squaredNorm();
        const CameraModel& model = w.synthetic.calibration.cameras[c].model;
        const auto predicted = model.project(window.T_CB[c] * (result.T_WB.inverse() * p.p_W));
        ASSERT_TRUE(predicted);
        pixels += (*predicted - model.project(p.measurement.ray()).value()).squaredNorm() / 0.49;
      }
      const double freedom = 2.0 * static_cast<double>(points.size()) - 6.0;
      whitened.add(sum, freedom);
      raw.add(pixels, freedom);
    }
  }
  expectConsistent(whitened);
  EXPECT_NEAR(whitened.ratio(), raw.ratio(), 0.01);  // the whitening's first order
}

}  // namespace
}  // namespace etalon::testing
