#include "residuals/pose_manifold.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/manifold_test_utils.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::kAttitudes;
using testing::kPosition;

/** A step that is no longer than half a turn. */
Eigen::VectorXd step(double scale) {
  Eigen::VectorXd d(6);
  d << 0.3, -0.5, 0.2, 1.0, -2.0, 3.0;
  return scale * d;
}

TEST(PoseManifold, PlusIsTheRightPerturbationAndMinusUndoesIt) {
  const PoseManifold manifold;
  for (const Vector3d& attitude : kAttitudes)
    for (const double scale : {1.0, 1e-3, 1e-5, 1e-12}) {
      const SE3 T(expSO3(attitude), kPosition);
      const Eigen::VectorXd d = step(scale);
      Eigen::VectorXd back(6);
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

void expectContract(const Eigen::VectorXd& x, const Eigen::VectorXd& delta,
                    const Eigen::VectorXd& y) {
  using namespace ceres;  // what the macro names
  const PoseManifold manifold;
  // Ceres' own tests of its quaternion manifolds allow 1e-9: numerical derivatives.
  EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
}

TEST(PoseManifold, KeepsTheContractOfCeres) {
  const Eigen::VectorXd y =
      testing::poseValue({expSO3(Vector3d(0.2, 0.9, -0.6)), Vector3d(0.5, 0.1, -4.0)});
  for (const Vector3d& attitude : kAttitudes)
    for (const double scale : {0.0, 1.0, 1e-3, 1e-5}) {
      const Eigen::VectorXd x = testing::poseValue({expSO3(attitude), kPosition});
      expectContract(x, step(scale), y);
      expectContract(x, step(scale), -y);  // the same rotation, another block
    }
}

/** Where the body sees a point: a residual whose derivatives are Ceres' affair alone. */
struct PointInBody {
  Vector3d p_W, p_B;
  template <typename T>
  bool operator()(const T* pose, T* r) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(pose);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(pose + 4);
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{r} = q.conjugate() * (p_W.cast<T>() - t) - p_B.cast<T>();
    return true;
  }
};

using PointCost = ceres::AutoDiffCostFunction<PointInBody, 3, 7>;

TEST(PoseManifold, AnAutoDiffResidualHasTheRightJacobian) {
  for (const Vector3d& attitude : kAttitudes) {
    const PointCost cost(new PointInBody{{3.0, 1.0, -2.0}, {0.5, 0.2, 1.0}});
    testing::expectJacobians(cost, {testing::poseValue({expSO3(attitude), kPosition})});
  }
}

TEST(PoseManifold, AnAutoDiffProblemFindsThePose) {
  const SE3 truth(expSO3(Vector3d(0.7, -1.1, 0.4)), kPosition);
  PoseBlock pose = toBlock({truth.R * expSO3(Vector3d(0.8, -0.6, 0.9)), Vector3d::Zero()});
  ceres::Problem problem;
  problem.AddParameterBlock(pose.data(), 7, new PoseManifold);
  for (const Vector3d& p_W : {Vector3d(1, 0, 0), Vector3d(0, 2, 0), Vector3d(0, 0, 3)})
    problem.AddResidualBlock(new PointCost(new PointInBody{p_W, truth.inverse() * p_W}), nullptr,
                             pose.data());
  ceres::Solver::Summary summary;
  ceres::Solve({}, &problem, &summary);
  const SE3 found = fromBlock(pose.data());
  // Quadratic near the solution, which has no residual: Ceres stops far below this.
  EXPECT_LT((found.R - truth.R).norm() + (found.t - truth.t).norm(), 1e-8);
}

}  // namespace
}  // namespace etalon
