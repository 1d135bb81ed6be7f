#include "residuals/ceres_blocks.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

using Blocks = std::vector<std::vector<double>>;

std::vector<double> poseBlock(const SE3& T_WB) {
  const PoseBlock block = toBlock(T_WB);
  return {block.begin(), block.end()};
}

std::vector<double> vectorBlock(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

std::vector<const double*> pointers(const Blocks& blocks) {
  std::vector<const double*> result;
  for (const std::vector<double>& block : blocks) result.push_back(block.data());
  return result;
}

VectorXd residual(const ceres::CostFunction& cost, const Blocks& blocks) {
  VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(pointers(blocks).data(), r.data(), nullptr));
  return r;
}

/** `block` moved in its tangent space: a pose by the manifold, all else by addition. */
std::vector<double> moved(const std::vector<double>& block, int axis, double step) {
  std::vector<double> result = block;
  if (block.size() == 7) {
    std::vector<double> delta(6, 0.0);
    delta[static_cast<size_t>(axis)] = step;
    PoseManifold().Plus(block.data(), delta.data(), result.data());
  } else {
    result[static_cast<size_t>(axis)] += step;
  }
  return result;
}

/** Central differences of order four against what Evaluate writes, block by block. */
void expectJacobians(const std::string& name, const ceres::CostFunction& cost,
                     const Blocks& blocks) {
  using RowMajorXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<RowMajorXd> J;
  for (const int size : cost.parameter_block_sizes())
    J.emplace_back(RowMajorXd::Constant(cost.num_residuals(), size, 7.0));
  std::vector<double*> J_pointers;
  for (RowMajorXd& block : J) J_pointers.push_back(block.data());
  VectorXd with(cost.num_residuals());
  ASSERT_TRUE(cost.Evaluate(pointers(blocks).data(), with.data(), J_pointers.data()));
  EXPECT_EQ(with, residual(cost, blocks)) << name;
  for (size_t b = 0; b < blocks.size(); ++b) {
    const bool pose = blocks[b].size() == 7;
    const int tangent = pose ? 6 : static_cast<int>(blocks[b].size());
    MatrixXd numerical(cost.num_residuals(), tangent);
    constexpr double kStep = 1e-3;
    for (int a = 0; a < tangent; ++a) {
      const auto at = [&](double step) {
        Blocks other = blocks;
        other[b] = moved(blocks[b], a, step);
        return residual(cost, other);
      };
      numerical.col(a) =
          (8.0 * (at(kStep) - at(-kStep)) - (at(2 * kStep) - at(-2 * kStep))) / (12.0 * kStep);
    }
    const MatrixXd analytic = J[b].leftCols(tangent);
    // Truncation h^4 f''''' and rounding 1e-16 f / h.
    EXPECT_LT((analytic - numerical).norm(), 1e-8 * (numerical.norm() + with.norm() + 1.0))
        << name << ", block " << b << "\nanalytic\n"
        << analytic << "\nnumerical\n"
        << numerical;
    if (pose) {
      EXPECT_EQ(J[b].col(6).norm(), 0.0) << name;  // no part in the tangent space
    }
    // A block that Ceres holds constant gets no Jacobian, and the others stay as they are.
    std::vector<double*> without = J_pointers;
    without[b] = nullptr;
    const RowMajorXd before = J[(b + 1) % J.size()];
    ASSERT_TRUE(cost.Evaluate(pointers(blocks).data(), with.data(), without.data()));
    EXPECT_EQ(J[(b + 1) % J.size()], before) << name;
  }
}

/** Attitudes: identity, tiny, ordinary, nearly half a turn. */
const Vector3d kAttitudes[] = {{0, 0, 0}, {1e-9, 0, -1e-9}, {0.7, -1.1, 0.4}, {0, M_PI - 1e-3, 0}};
const Vector3d kPosition(1.0, -2.0, 0.5);

TEST(PoseManifold, MinusUndoesPlusAndPlusIsTheRightPerturbation) {
  const PoseManifold manifold;
  for (const Vector3d& attitude : kAttitudes)
    for (const double scale : {1.0, 1e-3, 1e-5, 1e-12}) {
      const SE3 T(expSO3(attitude), kPosition);
      Eigen::Matrix<double, 6, 1> d, back;
      d << 0.3, -0.5, 0.2, 1.0, -2.0, 3.0;
      d *= scale;
      const PoseBlock x = toBlock(T);
      PoseBlock y;
      ASSERT_TRUE(manifold.Plus(x.data(), d.data(), y.data()));
      const SE3 T_y = fromBlock(y.data());
      EXPECT_LT((T_y.R - T.R * expSO3(d.head<3>())).norm(), 1e-14);
      EXPECT_LT((T_y.t - T.t - d.tail<3>()).norm(), 1e-14);
      ASSERT_TRUE(manifold.Minus(y.data(), x.data(), back.data()));
      EXPECT_LT((back - d).norm(), 1e-14);
    }
}

TEST(CeresBlocks, BiasPriorJacobianAgreesWithDifferences) {
  const BiasPriorCost cost({{0.01, -0.02, 0.03}, {0.1, 0.2, -0.3}}, 0.02, 0.5);
  VectorXd bias(6);
  bias << 0.05, 0.04, -0.03, -0.2, 0.1, 0.4;
  expectJacobians("bias prior", cost, {vectorBlock(bias)});
  // Gyro first, each in its own sigmas.
  const VectorXd r = residual(cost, {vectorBlock(bias)});
  EXPECT_NEAR(r[0], 0.04 / 0.02, 1e-12);
  EXPECT_NEAR(r[3], -0.3 / 0.5, 1e-12);
}

TEST(CeresBlocks, GaugeJacobianAgreesWithDifferences) {
  for (const Vector3d& attitude : kAttitudes)
    for (const Vector3d& off : {Vector3d(0, 0, 0), Vector3d(1e-9, 2e-9, 0),
                                Vector3d(0.1, 0.2, -0.3), Vector3d(1.2, 0.8, -1.5)}) {
      const SE3 reference(expSO3(attitude), kPosition);
      const GaugeCost cost(reference);
      const SE3 T(reference.R * expSO3(off), reference.t + Vector3d(0.1, -0.2, 0.3));
      expectJacobians("gauge", cost, {poseBlock(T)});
    }
}

TEST(CeresBlocks, SharedErrorJacobianAgreesWithDifferences) {
  for (const Vector3d& attitude : kAttitudes)
    for (const Vector3d& off : {Vector3d(0, 0, 0), Vector3d(0.1, 0.2, -0.3)}) {
      const SE3 body(expSO3(attitude), kPosition);
      const SE3 seen(body.R * expSO3(off), body.t + Vector3d(0.1, -0.2, 0.3));
      expectJacobians("shared error", SharedErrorCost(1e-3), {poseBlock(body), poseBlock(seen)});
    }
}

TEST(CeresBlocks, GaugeCostsNothingWhereOnlyTheTiltDiffers) {
  const SE3 reference(expSO3({0.7, -1.1, 0.4}), kPosition);
  const GaugeCost cost(reference);
  const SE3 tilted(expSO3({0.3, -0.2, 0.0}) * reference.R, reference.t);
  // Rounding of 1e-16 times the inverse sigma of 1e5.
  EXPECT_LT(residual(cost, {poseBlock(tilted)}).norm(), 1e-9);
  const SE3 turned(expSO3({0.0, 0.0, 0.1}) * reference.R, reference.t);
  EXPECT_NEAR(residual(cost, {poseBlock(turned)})[3], 0.1 * GaugeCost::kInverseSigma, 1e-6);
}

TEST(CeresBlocks, ReprojectionJacobiansAgreeWithDifferences) {
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  for (const CameraCalibration& camera : calibration.cameras)
    for (const Vector3d& attitude : kAttitudes)
      for (const double inverse_depth : {0.5, 1e-3, 0.0}) {
        const SE3 T_WB(expSO3(attitude), kPosition), T_CB = camera.T_BC.inverse();
        const Vector3d p_C(-0.5, 0.4, 2.0), p_W = T_WB * (camera.T_BC * p_C);
        const auto pixel = camera.model.project(p_C);
        ASSERT_TRUE(pixel);
        const auto m = makeMeasurement(camera.model, *pixel + Eigen::Vector2d(1.5, -0.7), 0.5);
        ASSERT_TRUE(m);
        // The origin is not the camera, and the bearing not quite the axis.
        InverseDepthLandmark landmark(p_W, kPosition + Vector3d(0.02, -0.03, 0.01));
        landmark.parameters = {0.01, -0.02, inverse_depth};
        const char free = 0, held = 1;
        expectJacobians("reprojection", ReprojectionCost(T_CB, *m, landmark, free),
                        {poseBlock(T_WB), vectorBlock(landmark.parameters)});
        // Held: the same, but for the inverse depth, which nothing moves.
        const ReprojectionCost cost(T_CB, *m, landmark, held);
        Vector2d r;
        Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J;
        double* jacobians[] = {nullptr, J.data()};
        const Blocks blocks = {poseBlock(T_WB), vectorBlock(landmark.parameters)};
        ASSERT_TRUE(cost.Evaluate(pointers(blocks).data(), r.data(), jacobians));
        EXPECT_GT(J.leftCols<2>().norm(), 100.0);
        EXPECT_EQ(J.col(2).norm(), 0.0);
      }
}

TEST(CeresBlocks, ALandmarkBehindTheCameraIsAnOutlierThatNothingMoves) {
  const CameraCalibration camera = testing::eurocCalibration().cameras[0];
  const SE3 T_WB, T_CB = camera.T_BC.inverse();
  const auto m = makeMeasurement(camera.model, {300, 200}, 0.5);
  ASSERT_TRUE(m);
  const InverseDepthLandmark behind(camera.T_BC * Vector3d(0.1, 0.2, -3.0), camera.T_BC.t);
  const char free = 0;
  const ReprojectionCost cost(T_CB, *m, behind, free);
  Vector2d r;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_landmark;
  double* jacobians[] = {J_pose.data(), J_landmark.data()};
  const Blocks blocks = {poseBlock(T_WB), vectorBlock(behind.parameters)};
  ASSERT_TRUE(cost.Evaluate(pointers(blocks).data(), r.data(), jacobians));
  EXPECT_EQ(r.norm(), kGrossOutlier);
  EXPECT_EQ(J_pose.norm() + J_landmark.norm(), 0.0);
}

TEST(CeresBlocks, PreintegrationJacobiansAgreeWithDifferencesAndAreWhitened) {
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  std::vector<ImuSample> samples;
  for (int k = 0; k <= 50; ++k) {
    const double t = 0.005 * k;
    ImuSample s;
    s.t = durationNs(t);
    s.gyro = Vector3d(std::sin(2 * t), 0.7 * std::cos(3 * t), -0.9 + 0.2 * t);
    s.accel = Vector3d(std::cos(t), 1.5 * std::sin(4 * t), 9.5 + std::sin(2 * t));
    samples.push_back(s);
  }
  const Preintegration p(samples, {{0.01, -0.02, 0.03}, {0.05, 0.1, -0.1}}, calibration.imu.noise);
  const Vector3d g_W(0, 0, -9.81), v_i(0.8, -1.2, 0.3), v_j(0.6, -1.0, 0.1);
  VectorXd bias(6);
  bias << 0.3, -0.2, 0.1, 0.5, -0.5, 0.2;
  for (const Vector3d& attitude : kAttitudes) {
    const SE3 T_i(expSO3(attitude), kPosition);
    const SE3 T_j(T_i.R * p.deltas().dR * expSO3({0.3, 0.2, -0.4}), kPosition + 0.2 * v_i);
    const PreintegrationCost cost(p, g_W);
    const Blocks blocks = {poseBlock(T_i), vectorBlock(v_i), poseBlock(T_j), vectorBlock(v_j),
                           vectorBlock(bias)};
    expectJacobians("preintegration", cost, blocks);
    // The squared norm is that by the covariance, whatever root of it whitens.
    const Eigen::Matrix<double, 9, 1> r =
        preintegrationResidual(p, T_i, v_i, T_j, v_j, {bias.head<3>(), bias.tail<3>()}, g_W);
    const double expected = r.dot(p.covariance9().fullPivLu().solve(r));
    EXPECT_NEAR(residual(cost, blocks).squaredNorm(), expected, 1e-9 * expected);
  }
}

}  // namespace
}  // namespace etalon
