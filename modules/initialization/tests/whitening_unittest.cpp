#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/initialization/steps/linear_alignment.h"
#include "etalon/initialization/steps/normal_epipolar_bias.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/initialization/steps/translation_ba.h"
#include "etalon/initialization/steps/translation_step.h"
#include "etalon/odometry/visual_solution.h"
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
    const Index n = 6 * w.preintegrations.size();
    MatrixXd root(n, n);  // dense: all poses hang together
    for (Index i = 0; i < n; ++i) root.col(i) = 1e-3 / std::sqrt(6.0) * drawn(n, &random);
    const VectorXd error = root * drawn(n, &random);
    for (size_t k = 1; k < w.T_VB.size(); ++k) {
      const Index i = 6 * (k - 1);
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
    poses.add(squaredMahalanobis(e, solution.covariance), static_cast<double>(e.size()));
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
    errors.add(squaredMahalanobis(e, result.covariance), 8.0);
  }
  expectConsistent(cost);
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
      errors.add(squaredMahalanobis(e, found.covariance), 3.0);
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
      // The poses go on below; those of stereo odometry are judged above.
      ASSERT_EQ(result.covariance.rows(), e.size() + 6 * problem.keyframeCount() - 6);
      const Eigen::MatrixXd whole_P = result.covariance.topLeftCorner(e.size(), e.size());
      whole->add(squaredMahalanobis(e, whole_P), static_cast<double>(e.size()));
      const Eigen::Matrix3d P = result.covariance.topLeftCorner<3, 3>();
      gyro_bias.add(squaredMahalanobis(e.head<3>(), P), 3.0);
    };
    add(estimate, &map);
    for (const bool free : {false, true}) {
      TranslationStepOptions translation;
      translation.ba.landmarks_free = free;
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

TEST(TrackInformation, PosesErrAsTheInformationSays) {
  ChiSquare errors;
  for (int run = 0; run < 40; ++run) {
    const double sigma_px = run % 2 == 0 ? 0.3 : 0.05;
    SyntheticWindowOptions options = withTracks(run, sigma_px, 100);
    options.motion = Motion::kGentle;
    options.keyframes = 5;
    const NoisyWindow w(options);
    const VisualWindow window = w.visual(sigma_px);
    TrackInformation tracks(window, 1e3);  // so wide that every weight is one
    std::vector<SE3> T_VB = w.T_VB;
    tracks.start(stereoPoints(window, 1e9), T_VB);
    for (int pass = 0; pass < 6; ++pass) {  // Gauss-Newton, as the depths change
      for (int i = 0; i < 3; ++i) tracks.triangulate(T_VB);
      tracks.linearize(T_VB);
      const VectorXd y = tracks.S().ldlt().solve(tracks.s());
      for (size_t k = 1; k < T_VB.size(); ++k) {
        const Index i = 6 * (k - 1);
        T_VB[k].R = nearestRotation(T_VB[k].R * expSO3(y.segment<3>(i)));
        T_VB[k].t += y.segment<3>(i + 3);
      }
    }
    const VectorXd e = poseErrors(T_VB, w.T_VB);
    errors.add(e.dot(tracks.S() * e), static_cast<double>(e.size()));
  }
  expectConsistent(errors);
}

}  // namespace
}  // namespace etalon::testing
