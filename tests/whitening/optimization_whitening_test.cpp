#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/initialization/steps/linear_alignment.h"
#include "etalon/initialization/steps/normal_epipolar_bias.h"
#include "etalon/initialization/steps/translation_ba.h"
#include "etalon/initialization/steps/translation_step.h"
#include "etalon/odometry/visual_solution.h"
#include "etalon/optimization/bundle/pose_only.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "noisy_window.h"
#include "statistics.h"

namespace etalon::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

VectorXd drawn(Index size, std::mt19937* random) {
  std::normal_distribution<double> normal;
  VectorXd x(size);
  for (Index i = 0; i < size; ++i) x[i] = normal(*random);
  return x;
}

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
      ASSERT_TRUE(reprojectionResidual(window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                       w.T_VB[static_cast<size_t>(m.keyframe)],
                                       landmarks[static_cast<size_t>(m.landmark)], &r));
      sample.add(r);
    }
  }
  EXPECT_GT(sample.count, 1000);
  expectWhite(sample);
}

/** Unknowns of a linear alignment: velocities, and gravity on its sphere. */
double alignmentFreedom(size_t keyframes) {
  const double n = static_cast<double>(keyframes);
  return 6.0 * (n - 1.0) - (3.0 * n + 2.0);
}

TEST(Whitening, LinearAlignmentCostsWhatItsFreedomSaysWithExactPoses) {
  ChiSquare chi2;
  for (int run = 0; run < 100; ++run) {
    const NoisyWindow w(imuOnly(run));
    const LinearAlignmentResult result = alignLinearly(w.T_VB, w.preintegrations, w.bias, {});
    ASSERT_TRUE(result.summary.usable());
    chi2.add(2.0 * result.summary.final_cost, alignmentFreedom(w.T_VB.size()));
  }
  expectConsistent(chi2);
}

TEST(Whitening, LinearAlignmentCostsWhatItsFreedomSaysWithCorrelatedPoses) {
  std::mt19937 random(5);
  ChiSquare chi2;
  for (int run = 0; run < 100; ++run) {
    NoisyWindow w(imuOnly(run));
    const Index n = 6 * static_cast<Index>(w.preintegrations.size());
    MatrixXd root(n, n);  // dense: all poses hang together
    for (Index i = 0; i < n; ++i) root.col(i) = 1e-3 / std::sqrt(6.0) * drawn(n, &random);
    const VectorXd error = root * drawn(n, &random);
    for (size_t k = 1; k < w.T_VB.size(); ++k) {
      const Index i = 6 * (static_cast<Index>(k) - 1);
      w.T_VB[k].R = w.T_VB[k].R * expSO3(error.segment<3>(i));
      w.T_VB[k].t += error.segment<3>(i + 3);
    }
    LinearAlignmentOptions options;
    options.pose_covariance = root * root.transpose();
    const LinearAlignmentResult result = alignLinearly(w.T_VB, w.preintegrations, w.bias, options);
    ASSERT_TRUE(result.summary.usable());
    chi2.add(2.0 * result.summary.final_cost, alignmentFreedom(w.T_VB.size()));
  }
  expectConsistent(chi2);
}

StereoOdometryOptions odometryOptions(double sigma_px) {
  StereoOdometryOptions options;
  options.sigma_px = sigma_px;
  return options;
}

VisualSolution visualSolution(const NoisyWindow& w, double sigma_px) {
  std::vector<Eigen::Matrix3d> R_prev_cur;
  for (const Preintegration& p : w.preintegrations) R_prev_cur.push_back(p.deltas().dR);
  return solveStereoOdometry(w.synthetic.calibration, w.synthetic.keyframes(), R_prev_cur,
                             odometryOptions(sigma_px))
      .value();
}

/** The errors are what the joint covariance says, in its order and on its side; and the linear
 * alignment, which takes it over, agrees. */
TEST(Whitening, StereoOdometrysJointCovarianceIsThatOfItsErrorsAndOfItsConsumers) {
  ChiSquare poses, alignment;
  for (int run = 0; run < 80; ++run) {
    SyntheticWindowOptions options = withTracks(run, 0.5, 100);
    options.motion = Motion::kGentle;
    options.keyframes = 8;
    const NoisyWindow w(options);
    const VisualSolution solution = visualSolution(w, 0.5);
    const VectorXd e = poseErrors(solution.T_VB, w.T_VB);
    ASSERT_EQ(solution.covariance.rows(), e.size());
    poses.add(e.dot(solution.covariance.ldlt().solve(e)), static_cast<double>(e.size()));
    LinearAlignmentOptions align;
    align.pose_covariance = solution.covariance;
    const LinearAlignmentResult result =
        alignLinearly(solution.T_VB, w.preintegrations, w.bias, align);
    ASSERT_TRUE(result.summary.usable());
    alignment.add(2.0 * result.summary.final_cost, alignmentFreedom(w.T_VB.size()));
  }
  expectConsistent(poses);
  expectConsistent(alignment);
}

TEST(Whitening, InertialOnlyMapIsConsistent) {
  std::mt19937 random(6);
  ChiSquare cost, errors;
  for (int run = 0; run < 60; ++run) {
    SyntheticWindowOptions options = imuOnly(run);
    constexpr double kSigmaGyro = 0.02, kSigmaAccel = 0.1;
    options.bias = {kSigmaGyro * drawn(3, &random), kSigmaAccel * drawn(3, &random)};
    const NoisyWindow w(options);
    InertialOnlyOptions map;
    map.prior_gyro_information = 1.0 / (kSigmaGyro * kSigmaGyro);
    map.prior_accel_information = 1.0 / (kSigmaAccel * kSigmaAccel);
    Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  // of the covariance, not diagonal
    root << 2e-4, 0, 0, -1e-4, 1e-4, 0, 3e-4, 1e-4, 1e-4;
    map.gyro_bias = GyroBiasMeasurement{w.bias.gyro + root * drawn(3, &random),
                                        (root * root.transpose()).inverse()};
    const InertialOnlyResult first = solveInertialOnlyMap(w.T_VB, w.preintegrate({}), map);
    const InertialOnlyResult result = solveInertialOnlyMap(w.T_VB, w.preintegrate(first.bias), map);
    ASSERT_TRUE(result.summary.usable());
    ASSERT_EQ(result.covariance.rows(), 8);
    const double n = static_cast<double>(w.T_VB.size());
    cost.add(2.0 * result.summary.final_cost, 9.0 * (n - 1.0) + 6.0 + 3.0 - (8.0 + 3.0 * n));
    VectorXd e(8);
    e << result.bias.gyro - w.bias.gyro, result.bias.accel - w.bias.accel,
        -tangentBasis(result.g_V).transpose() * w.g_V / w.g_V.norm();
    errors.add(e.dot(result.covariance.ldlt().solve(e)), 8.0);
  }
  expectConsistent(cost);
  expectConsistent(errors);
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
    for (const KeyframeState& s : w.synthetic.truth) problem.states.push_back({s.T_WB, s.v_WB});
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
    const std::vector<VisualInertialState>& states = problem.states;
    const Index n = static_cast<Index>(states.size());
    ASSERT_EQ(result.covariance.rows(), 9 * n + 6);
    VectorXd e(9 * n + 6);
    for (size_t k = 0; k < states.size(); ++k)
      e.segment<9>(9 * static_cast<Index>(k))
          << logSO3(states[k].T_WB.R.transpose() * result.states[k].T_WB.R),
          result.states[k].T_WB.t - states[k].T_WB.t, result.states[k].v_WB - states[k].v_WB;
    e.tail<6>() << result.bias.gyro - w.bias.gyro, result.bias.accel - w.bias.accel;
    // Position and yaw of the first keyframe are held at the truth.
    errors.add(e.dot(result.covariance.ldlt().solve(e)), static_cast<double>(e.size() - 4));
  }
  expectConsistent(errors);
}

TEST(Whitening, TranslationBaCostsWhatItsFreedomSays) {
  for (const bool landmarks_free : {false, true}) {
    ChiSquare chi2;
    for (int run = 0; run < 10; ++run) {
      const NoisyWindow w(withTracks(run, 0.7, 60));
      const VisualWindow window = w.visual(0.7);
      TranslationBaOptions ba;
      ba.chi2_threshold = 1e6;
      ba.landmarks_free = landmarks_free;
      const TranslationBaResult result = solveTranslationBa(
          BundleProblem(window, testing::knownLandmarks(w.landmarks_V)), w.T_VB, ba);
      ASSERT_TRUE(result.summary.usable());
      const double rows = 2.0 * result.inliers;
      double freedom = rows - 3.0 * (static_cast<double>(w.T_VB.size()) - 1.0);
      if (landmarks_free) freedom -= 3.0 * window.landmarkCount();
      chi2.add(rows * std::pow(result.rms_px_over_sigma, 2), freedom);
    }
    expectConsistent(chi2);
  }
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
        if (m.keyframe == k)
          points.push_back({landmarks[static_cast<size_t>(m.landmark)], m.camera, m.measurement});
      const PoseOnlyResult result =
          solvePoseOnly(window.T_CB, points, w.T_VB[static_cast<size_t>(k)], options);
      ASSERT_TRUE(result.summary.usable());
      double sum = 0.0, pixels = 0.0;
      for (const PointMeasurement& p : points) {
        const auto c = static_cast<size_t>(p.camera);
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

/** An observation takes part in many pairs, and the gyro's noise of an interval as well: the
 * covariance follows both through all of them. */
TEST(Whitening, NormalEpipolarBiasErrsAsItsCovarianceSays) {
  for (const Motion motion : {Motion::kGentle, Motion::kAggressive, Motion::kStandstill}) {
    SCOPED_TRACE(toString(motion));
    ChiSquare errors;
    double noise = 0.0;
    const int runs = motion == Motion::kAggressive ? 80 : 40;
    for (int run = 0; run < runs; ++run) {
      SyntheticWindowOptions window = withTracks(run, 0.5, 60);
      window.motion = motion;
      window.keyframes = 8;
      const NoisyWindow w(window);
      NormalEpipolarBiasOptions options;
      options.sigma_px = 0.5;
      const NormalEpipolarBias found =
          estimateGyroBias(w.synthetic.calibration, w.synthetic.keyframes(), w.preintegrate({}),
                           Vector3d::Zero(), options);
      ASSERT_TRUE(found.summary.usable()) << found.summary.message;
      const Vector3d e = found.gyro - w.bias.gyro;
      errors.add(e.dot(found.covariance.ldlt().solve(e)), 3.0);
      noise += found.noise / runs;
    }
    EXPECT_NEAR(noise, 1.0, 0.1);
    expectConsistent(errors);
  }
}

/** Noise and biases as the problem believes them; the plugins' MAP believes in exact poses and b_a
 * = 0 all the same. Errors b_g, b_a, tilt, velocity. */
TEST(Whitening, DecoupledStepsErrAsTheirCovarianceSays) {
  std::mt19937 random(8);
  ChiSquare map, translations[2], gyro_bias;
  for (int run = 0; run < 40; ++run) {
    SyntheticWindowOptions options = withTracks(run, 0.5, 80);
    options.motion = Motion::kGentle;
    options.keyframes = 8;
    options.bias = {0.1 * drawn(3, &random), 0.1 * drawn(3, &random)};
    SyntheticWindow window = makeSyntheticWindow(options);
    window.calibration.imu.noise.gyro_random_walk *= 1e-3;
    window.calibration.imu.noise.accel_random_walk *= 1e-3;
    const InitializationProblem problem = makeProblem(window, options);
    const Expected<InertialOnlyStep> found = solveInertialOnlyStep(problem, {});
    ASSERT_TRUE(found && found->errors);
    const InertialOnlyStep& step = *found;
    VisualFrameEstimate estimate{problem.visualSolution()->T_VB,
                                 step.map.v_VB,
                                 step.map.g_V,
                                 {},
                                 step.map.bias,
                                 step.errors};
    const auto add = [&](const VisualFrameEstimate& x, ChiSquare* whole) {
      const Initialization result = alignWithGravity(problem, x);
      const VectorXd e = estimationError(result, window);
      ASSERT_EQ(result.covariance.rows(), e.size());
      whole->add(e.dot(result.covariance.ldlt().solve(e)), static_cast<double>(e.size()));
      const Eigen::Matrix3d P = result.covariance.topLeftCorner<3, 3>();
      gyro_bias.add(e.head<3>().dot(P.ldlt().solve(e.head<3>())), 3.0);
    };
    add(estimate, &map);
    for (const bool free : {false, true}) {
      TranslationStepOptions translation;
      translation.landmarks = free ? "free" : "fixed";
      const Expected<TranslationStep> moved = solveTranslationStep(
          problem, step.preintegrations, step.map.bias, step.map.g_V, translation, step.errors);
      ASSERT_TRUE(moved && moved->estimate.errors);
      add(moved->estimate, &translations[free]);
    }
  }
  expectConsistent(map);
  expectConsistent(translations[0]);
  expectConsistent(translations[1]);
  // One b_g for all three: a third of the degrees of freedom.
  gyro_bias.sum /= 3.0;
  gyro_bias.dof /= 3.0;
  expectConsistent(gyro_bias);
}

}  // namespace
}  // namespace etalon::testing
