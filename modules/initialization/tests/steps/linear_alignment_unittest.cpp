#include "etalon/initialization/steps/linear_alignment.h"

#include <gtest/gtest.h>

#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindowOptions;

constexpr double kGravityNorm = 9.81;

/** Exact poses in V, the frame of the first body, with the IMU between them. */
struct AlignmentCase {
  explicit AlignmentCase(const SyntheticWindowOptions& options)
      : window(testing::makeSyntheticWindow(options)), bias(options.bias) {
    T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& s : window.truth) T_VB.push_back(T_VW * s.T_WB);
    g_V = T_VW.R * Vector3d(0, 0, -kGravityNorm);
    for (size_t k = 1; k < window.truth.size(); ++k)
      preintegrations.emplace_back(window.imu.between(window.truth[k - 1].t, window.truth[k].t),
                                   bias, window.calibration.imu.noise);
  }
  double velocityError(const LinearAlignmentResult& result) const {
    double sum = 0.0;
    for (size_t k = 0; k < T_VB.size(); ++k)
      sum += (result.v_VB[k] - T_VW.R * window.truth[k].v_WB).squaredNorm();
    return std::sqrt(sum / static_cast<double>(T_VB.size()));
  }
  testing::SyntheticWindow window;
  ImuBias bias;
  SE3 T_VW;
  std::vector<SE3> T_VB;
  Vector3d g_V;
  std::vector<Preintegration> preintegrations;
};

SyntheticWindowOptions withBias() {
  SyntheticWindowOptions options;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  return options;
}

TEST(LinearAlignment, IsExactOnExactPosesFromASeed) {
  const AlignmentCase c(withBias());
  const Vector3d seed = expSO3(Vector3d(0.2, 0.1, 0.0)) * c.g_V;  // 13 degrees off
  const LinearAlignmentResult result =
      alignVelocitiesAndGravity(c.T_VB, c.preintegrations, c.bias, kGravityNorm, seed);
  ASSERT_TRUE(result.summary.usable());
  EXPECT_LT(angleBetween(result.g_V, c.g_V), 1e-8);
  EXPECT_LT(c.velocityError(result), 1e-8);
}

TEST(LinearAlignment, IsExactOnExactPosesWithEveryWeightAndConstraint) {
  for (const testing::Motion motion : testing::kAllMotions) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions window = withBias();
    window.motion = motion;
    const AlignmentCase c(window);
    const Eigen::Index n = 6 * c.preintegrations.size();
    for (int variant = 0; variant < 4; ++variant) {
      LinearAlignmentOptions options;
      options.weighted = variant > 0;
      if (variant > 1) options.pose_covariance = 1e-6 * Eigen::MatrixXd::Identity(n, n);
      if (variant > 2) options.tangent_iterations = 0;
      const LinearAlignmentResult result =
          alignLinearly(c.T_VB, c.preintegrations, c.bias, options);
      ASSERT_TRUE(result.summary.usable());
      EXPECT_LT(angleBetween(result.g_V, c.g_V), 1e-8);
      EXPECT_LT(c.velocityError(result), 1e-8);
      EXPECT_NEAR(result.free_gravity_mps2, kGravityNorm, 1e-7);
      EXPECT_NEAR(result.summary.final_cost, 0.0, 1e-6);
    }
  }
}

TEST(LinearAlignment, WeightsByThePosesCovariancePayWhereOnePoseIsBad) {
  SyntheticWindowOptions window;
  window.motion = testing::Motion::kAggressive;
  const AlignmentCase c(window);
  const Eigen::Index n = 6 * c.preintegrations.size();
  Eigen::MatrixXd covariance = 1e-8 * Eigen::MatrixXd::Identity(n, n);
  constexpr Eigen::Index kBad = 4;  // keyframe kBad + 1: 0.1 m and 0.05 rad
  covariance.block<3, 3>(6 * kBad, 6 * kBad).diagonal().setConstant(0.05 * 0.05);
  covariance.block<3, 3>(6 * kBad + 3, 6 * kBad + 3).diagonal().setConstant(0.1 * 0.1);
  std::vector<SE3> T_VB = c.T_VB;
  T_VB[kBad + 1].R = T_VB[kBad + 1].R * expSO3(Vector3d(0.03, -0.04, 0.02));
  T_VB[kBad + 1].t += Vector3d(0.05, -0.1, 0.05);
  LinearAlignmentOptions options;
  const LinearAlignmentResult exact_poses = alignLinearly(T_VB, c.preintegrations, c.bias, options);
  options.pose_covariance = covariance;
  const LinearAlignmentResult weighted = alignLinearly(T_VB, c.preintegrations, c.bias, options);
  ASSERT_TRUE(exact_poses.summary.usable() && weighted.summary.usable());
  EXPECT_LT(angleBetween(weighted.g_V, c.g_V), 0.2 * angleBetween(exact_poses.g_V, c.g_V));
}

/** A window whose accelerometer has a bias that the alignment does not know of. */
AlignmentCase misled() {
  SyntheticWindowOptions window = withBias();
  window.motion = testing::Motion::kAggressive;
  AlignmentCase c(window);
  c.bias.accel.setZero();
  for (Preintegration& p : c.preintegrations) p = p.reintegrated(c.bias);
  return c;
}

/** Half the sum of squares of the preintegration residual's position and velocity rows. */
double inertialCost(const AlignmentCase& c, const LinearAlignmentResult& at) {
  double sum = 0.0;
  for (size_t k = 0; k < c.preintegrations.size(); ++k) {
    const Preintegration& p = c.preintegrations[k];
    const Eigen::Matrix<double, 6, 1> r =
        preintegrationResidual(p, c.T_VB[k], at.v_VB[k], c.T_VB[k + 1], at.v_VB[k + 1], c.bias,
                               at.g_V, nullptr)
            .tail<6>();
    const Eigen::Matrix<double, 6, 6> noise = p.covariance9().bottomRightCorner<6, 6>();
    sum += 0.5 * squaredMahalanobis(r, noise);
  }
  return sum;
}

TEST(LinearAlignment, ItsCostIsThatOfThePreintegrationResidualAndLeast) {
  const AlignmentCase c = misled();
  LinearAlignmentOptions options;
  options.tangent_iterations = 0;
  const LinearAlignmentResult best = alignLinearly(c.T_VB, c.preintegrations, c.bias, options);
  ASSERT_TRUE(best.summary.usable());
  EXPECT_GT(best.summary.final_cost, 100.0);  // it is misled
  EXPECT_NEAR(best.summary.final_cost, inertialCost(c, best), 1e-6 * best.summary.final_cost);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    LinearAlignmentResult other = best;
    for (Vector3d& v : other.v_VB) v += 1e-3 * Vector3d(normal(random), normal(random), 0.0);
    other.g_V = expSO3(1e-3 * Vector3d(normal(random), normal(random), 0.0)) * other.g_V;
    EXPECT_GT(inertialCost(c, other), best.summary.final_cost);
  }
}

TEST(LinearAlignment, AgreesWithTheInertialOnlyMapThatHoldsTheBiases) {
  const AlignmentCase c = misled();
  InertialOnlyOptions held;
  held.prior_mean = c.bias;
  held.prior_gyro_information = held.prior_accel_information = 1e12;
  const InertialOnlyResult map = solveInertialOnlyMap(c.T_VB, c.preintegrations, held);
  ASSERT_TRUE(map.summary.converged());
  const LinearAlignmentResult result =
      alignVelocitiesAndGravity(c.T_VB, c.preintegrations, c.bias, kGravityNorm, map.g_V);
  ASSERT_TRUE(result.summary.usable());
  // They differ by the rotation rows alone, which the MAP has and exact rotations leave at zero.
  EXPECT_LT(angleBetween(result.g_V, map.g_V), 1e-4);
  for (size_t k = 0; k < map.v_VB.size(); ++k)
    EXPECT_LT((result.v_VB[k] - map.v_VB[k]).norm(), 2e-4) << "keyframe " << k;
}

/** The joint whitening with poses all but exact is the whitening pair by pair. */
TEST(LinearAlignment, ExactPosesHaveNoPartInTheWeights) {
  const AlignmentCase c = misled();
  const Eigen::Index n = 6 * c.preintegrations.size();
  LinearAlignmentOptions options;
  const LinearAlignmentResult pairs = alignLinearly(c.T_VB, c.preintegrations, c.bias, options);
  options.pose_covariance = 1e-18 * Eigen::MatrixXd::Identity(n, n);
  const LinearAlignmentResult joint = alignLinearly(c.T_VB, c.preintegrations, c.bias, options);
  ASSERT_TRUE(pairs.summary.usable() && joint.summary.usable());
  EXPECT_NEAR(joint.summary.final_cost, pairs.summary.final_cost, 1e-4 * pairs.summary.final_cost);
  for (size_t k = 0; k < pairs.v_VB.size(); ++k)
    EXPECT_LT((joint.v_VB[k] - pairs.v_VB[k]).norm(), 1e-5);
}

TEST(LinearAlignment, RefusesAWindowThatDoesNotDetermineGravity) {
  // 6 rows for 9 unknowns: the pivots that should be zero are rounding errors, often positive.
  for (const bool weighted : {false, true})
    for (unsigned seed = 1; seed <= 40; ++seed) {
      SyntheticWindowOptions window = withBias();
      window.motion = testing::Motion::kAggressive;
      window.keyframes = 2;
      window.landmarks = 10;
      window.seed = seed;
      const AlignmentCase c(window);
      LinearAlignmentOptions options;
      options.weighted = weighted;
      for (const int iterations : {0, 4}) {
        options.tangent_iterations = iterations;
        EXPECT_EQ(alignLinearly(c.T_VB, c.preintegrations, c.bias, options).summary.termination,
                  Termination::kSingular);
      }
      EXPECT_EQ(alignVelocitiesAndGravity(c.T_VB, c.preintegrations, c.bias, kGravityNorm,
                                          Vector3d(c.g_V))
                    .summary.termination,
                Termination::kSingular);
      EXPECT_EQ(
          linearAlignmentResponse(c.T_VB, c.preintegrations, c.bias, options, c.g_V).by_rows.size(),
          0);
    }
}

TEST(LinearAlignment, ThreeKeyframesAreEnough) {
  SyntheticWindowOptions window = withBias();
  window.motion = testing::Motion::kAggressive;
  window.keyframes = 3;
  const AlignmentCase c(window);
  const LinearAlignmentResult result = alignLinearly(c.T_VB, c.preintegrations, c.bias, {});
  ASSERT_TRUE(result.summary.usable());
  EXPECT_LT(angleBetween(result.g_V, c.g_V), 1e-8);  // rounding, as with ten
}

}  // namespace
}  // namespace etalon
