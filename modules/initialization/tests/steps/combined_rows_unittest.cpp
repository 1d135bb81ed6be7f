// Least squares on combinations of the pairs' rows, and the gyro bias that comes before it.

#include "etalon/initialization/steps/combined_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Motion;
using testing::SyntheticWindowOptions;

const ImuBias kBias{{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};

SyntheticWindowOptions biasedWindow(double sigma_px = 0.0) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.keyframes = 6;
  options.bias = kBias;
  options.sigma_px = sigma_px;
  return options;
}

/** A window without noise whose visual solution is the truth; the estimate has the true biases. */
struct RowsCase {
  explicit RowsCase(const SyntheticWindowOptions& options = biasedWindow())
      : window(testing::makeSyntheticWindow(options)),
        problem(testing::makeProblem(window, options)),
        pairs(problem.preintegrate(kBias)) {
    estimate.bias = kBias;
    T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& state : window.truth) estimate.T_VB.push_back(T_VW * state.T_WB);
    g_V = T_VW.R * Vector3d(0, 0, -9.81);
  }
  Vector3d velocity(size_t k) const { return T_VW.R * window.truth[k].v_WB; }
  double velocityError() const {
    double largest = 0.0;
    for (size_t k = 0; k < estimate.v_VB.size(); ++k)
      largest = std::max(largest, (estimate.v_VB[k] - velocity(k)).norm());
    return largest;
  }

  testing::SyntheticWindow window;
  InitializationProblem problem;
  std::vector<Preintegration> pairs;
  VisualFrameEstimate estimate;
  SE3 T_VW;
  Vector3d g_V;
};

TEST(CombinedRows, TriplesHaveNoVelocityAndTheTruthSolvesThem) {
  const RowsCase c;
  const CombinedRows triples(c.problem, c.pairs, c.estimate,
                             triplesOfPairs(c.estimate.T_VB, c.pairs));
  ASSERT_EQ(triples.y.size(), 12);
  const MatrixXd velocities = triples.T * triples.rows.A.leftCols(triples.rows.A.cols() - 3);
  EXPECT_LT(velocities.norm(), 1e-12);
  EXPECT_LT((triples.y - triples.gravity * c.g_V).norm(), 1e-9);
}

TEST(CombinedRows, ColumnsAreTheDerivativesByAccelerometerBiasAndScale) {
  const RowsCase c;
  const MatrixXd T = triplesOfPairs(c.estimate.T_VB, c.pairs);
  const CombinedRows triples(c.problem, c.pairs, c.estimate, T);
  const auto by_accel = [&](const Vector3d& b_a) {
    VisualFrameEstimate moved = c.estimate;
    moved.bias.accel = b_a;
    return VectorXd(CombinedRows(c.problem, c.pairs, moved, T).y);
  };
  testing::expectJacobian(MatrixXd(-triples.accel), by_accel, Vector3d(kBias.accel));
  const auto by_scale = [&](const Eigen::Matrix<double, 1, 1>& s) {
    VisualFrameEstimate moved = c.estimate;
    rescale(s[0], triples.camera, &moved);
    return VectorXd(CombinedRows(c.problem, c.pairs, moved, T).y);
  };
  testing::expectJacobian(MatrixXd(-triples.scale), by_scale, Eigen::Matrix<double, 1, 1>(1.0));
}

TEST(CombinedRows, FindsGravityBiasScaleAndVelocitiesOfExactPoses) {
  for (const bool first_velocity : {false, true})
    for (const bool free_scale : {false, true}) {
      SCOPED_TRACE(std::to_string(first_velocity) + std::to_string(free_scale));
      RowsCase c;
      c.estimate.bias.accel.setZero();
      if (free_scale) {  // seen a tenth too small
        const CombinedRows as_it_is(c.problem, c.pairs, c.estimate,
                                    triplesOfPairs(c.estimate.T_VB, c.pairs));
        rescale(0.9, as_it_is.camera, &c.estimate);
      }
      const MatrixXd T = first_velocity ? positionsOfPairs(c.estimate.T_VB, c.pairs)
                                        : triplesOfPairs(c.estimate.T_VB, c.pairs);
      CombinedRowsOptions options;
      options.passes = 10;
      options.first_velocity = first_velocity;
      options.free_scale = free_scale;
      const CombinedRows rows(c.problem, c.pairs, c.estimate, T);
      ASSERT_TRUE(solveCombinedRows(c.problem, rows, options, &c.estimate));
      EXPECT_LT((c.estimate.g_V - c.g_V).norm(), 1e-6);
      EXPECT_LT((c.estimate.bias.accel - kBias.accel).norm(), 1e-6);
      EXPECT_LT(c.velocityError(), 1e-6);
      for (size_t k = 0; k < c.estimate.T_VB.size(); ++k)
        EXPECT_LT((c.estimate.T_VB[k].t - (c.T_VW * c.window.truth[k].T_WB).t).norm(), 1e-6);
    }
}

/** x is where in the body the path was seen. */
TEST(CombinedRows, FindsTheMethodsOwnUnknown) {
  RowsCase c;
  const Vector3d lever(0.05, -0.1, 0.02);
  std::vector<SE3>& T_VB = c.estimate.T_VB;
  MatrixXd extra = MatrixXd::Zero(6 * c.pairs.size(), 3);
  for (size_t k = 0; k < c.pairs.size(); ++k)
    extra.middleRows<3>(6 * k) =
        T_VB[k].R.transpose() * T_VB[k + 1].R - Eigen::Matrix3d::Identity();
  for (SE3& pose : T_VB) pose.t += pose.R * lever;
  CombinedRowsOptions options;
  options.passes = 10;
  const CombinedRows rows(c.problem, c.pairs, c.estimate, triplesOfPairs(T_VB, c.pairs), extra);
  const auto own = solveCombinedRows(c.problem, rows, options, &c.estimate);
  ASSERT_TRUE(own) << own.error().reason;
  EXPECT_LT((own->x - lever).norm(), 1e-5);
  EXPECT_LT((c.estimate.g_V - c.g_V).norm(), 1e-5);
}

TEST(CombinedRows, RefusesWhatIsNotDeterminedAndWhatIsNotGravity) {
  RowsCase c;
  CombinedRowsOptions options;
  options.max_condition = 1.5;
  const CombinedRows triples(c.problem, c.pairs, c.estimate,
                             triplesOfPairs(c.estimate.T_VB, c.pairs));
  EXPECT_EQ(solveCombinedRows(c.problem, triples, options, &c.estimate).error().status,
            RefusalStatus::kIllConditioned);
  options = {};
  options.max_gravity_deviation_mps2 = 0.0;
  EXPECT_EQ(solveCombinedRows(c.problem, triples, options, &c.estimate).error().status,
            RefusalStatus::kImplausible);
}

TEST(RescaledPath, MovesTheCameraAndWhatItSeesAndTurnsNothing) {
  RowsCase c;
  c.estimate.landmarks[7] = {1.0, 2.0, 3.0};
  const CombinedRows rows(c.problem, c.pairs, c.estimate, triplesOfPairs(c.estimate.T_VB, c.pairs));
  VisualFrameEstimate moved = c.estimate;
  rescale(1.25, rows.camera, &moved);
  const Vector3d lever = c.problem.calibration().cameras[0].T_BC.t;
  for (size_t k = 0; k < moved.T_VB.size(); ++k) {
    const Vector3d camera = moved.T_VB[k] * lever;
    EXPECT_LT((camera - rows.camera[0] - 1.25 * (rows.camera[k] - rows.camera[0])).norm(), 1e-12);
    EXPECT_EQ(moved.T_VB[k].R, c.estimate.T_VB[k].R);
  }
  EXPECT_LT(
      (moved.landmarks[7] - rows.camera[0] - 1.25 * (c.estimate.landmarks[7] - rows.camera[0]))
          .norm(),
      1e-12);
}

TEST(GyroBiasOfRotations, IsExactWithEveryWeightAndOffToSecondOrderAfterOnePass) {
  const RowsCase c;
  VisualSolution visual;
  visual.T_VB = c.estimate.T_VB;
  const Index n = 6 * c.pairs.size();
  visual.covariance = 1e-6 * MatrixXd::Identity(n, n);
  for (const RowWeights weights :
       {RowWeights::kNone, RowWeights::kImu, RowWeights::kImuAndVision}) {
    const auto found = gyroBiasOfRotations(c.problem, visual, weights, 6);
    ASSERT_TRUE(found);
    EXPECT_LT((found->bias.gyro - kBias.gyro).norm(), 1e-8);
    EXPECT_EQ(found->bias.accel, c.problem.priors().mean.accel);
    EXPECT_EQ(found->preintegrations.front().bias().gyro, found->bias.gyro);
    const auto once = gyroBiasOfRotations(c.problem, visual, weights, 1);
    EXPECT_GT((once->bias.gyro - kBias.gyro).norm(), 1e-7);
    EXPECT_LT((once->bias.gyro - kBias.gyro).norm(), 0.01 * kBias.gyro.norm());
  }
}

/** db_g/dr: the bias answers to rotations that are moved as its response says. */
TEST(GyroBiasOfRotations, RespondsToRotationsAsItSays) {
  const SyntheticWindowOptions options = biasedWindow(0.5);
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  ASSERT_TRUE(problem.visualSolution());
  VisualSolution visual = *problem.visualSolution();
  const auto before = gyroBiasOfRotations(problem, visual, RowWeights::kImu, 10);
  ASSERT_TRUE(before);
  const Vector3d turn(1e-4, -2e-4, 1.5e-4);
  visual.T_VB.back().R = visual.T_VB.back().R * expSO3(turn);
  const auto after = gyroBiasOfRotations(problem, visual, RowWeights::kImu, 10);
  const Vector3d expected = before->response.rightCols<3>() * turn;
  EXPECT_LT((after->bias.gyro - before->bias.gyro - expected).norm(), 2e-2 * expected.norm());
}

TEST(GyroBiasOfRotations, TheEstimateHasErrorsWhereVisionHasACovariance) {
  const SyntheticWindowOptions options = biasedWindow(0.5);
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  ASSERT_TRUE(problem.visualSolution());
  VisualSolution visual = *problem.visualSolution();
  const auto found = gyroBiasOfRotations(problem, visual, RowWeights::kImu, 3);
  ASSERT_TRUE(found);
  const VisualFrameEstimate estimate = found->estimate(problem, visual);
  ASSERT_TRUE(estimate.errors);
  EXPECT_EQ(estimate.errors->poses.rows(), 6 * 5);
  EXPECT_EQ(estimate.landmarks.size(), visual.landmarks.size());
  const MatrixXd P = estimate.errors->sources.covarianceOf(estimate.errors->map);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LT(std::sqrt(P(axis, axis)), 0.02);  // b_g is found
    EXPECT_NEAR(std::sqrt(P(3 + axis, 3 + axis)), problem.priors().sigma_accel_mps2, 1e-12);
  }
  visual.covariance.resize(0, 0);
  EXPECT_FALSE(found->estimate(problem, visual).errors);
}

}  // namespace
}  // namespace etalon
