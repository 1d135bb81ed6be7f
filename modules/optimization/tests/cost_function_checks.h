#pragma once

#include <ceres/cost_function.h>

#include <string>
#include <vector>

#include "etalon/testing/expect_jacobian.h"
#include "residuals/pose_manifold.h"

// What the tests of all cost functions share.
namespace etalon::testing {

/** Attitudes: identity, tiny, ordinary, nearly half a turn. */
inline const Eigen::Vector3d kAttitudes[] = {
    {0, 0, 0}, {1e-9, 0, -1e-9}, {0.7, -1.1, 0.4}, {0, M_PI - 1e-3, 0}};
inline const Eigen::Vector3d kPosition(1.0, -2.0, 0.5);

/** Parameter blocks of a cost function: a pose is a PoseBlock, all else a vector. */
using Values = std::vector<Eigen::VectorXd>;

inline Eigen::VectorXd poseValue(const SE3& T_WB) {
  const PoseBlock block = toBlock(T_WB);
  return Eigen::Map<const Eigen::VectorXd>(block.data(), 7);
}

inline std::vector<const double*> pointers(const Values& values) {
  std::vector<const double*> result;
  for (const Eigen::VectorXd& value : values) result.push_back(value.data());
  return result;
}

inline Eigen::VectorXd residual(const ceres::CostFunction& cost, const Values& values) {
  Eigen::VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(pointers(values).data(), r.data(), nullptr));
  return r;
}

/** What Evaluate() writes, block by block: by the numbers of the block, of which a pose has seven.
 */
inline std::vector<Eigen::MatrixXd> ambientJacobians(const ceres::CostFunction& cost,
                                                     const Values& values) {
  using RowMajorXd = RowMajor<Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<RowMajorXd> J;
  std::vector<double*> J_pointers;
  for (const int size : cost.parameter_block_sizes())
    J.emplace_back(RowMajorXd::Constant(cost.num_residuals(), size, 7.0));
  for (RowMajorXd& block : J) J_pointers.push_back(block.data());
  Eigen::VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(pointers(values).data(), r.data(), J_pointers.data()));
  EXPECT_EQ(r, residual(cost, values));
  // A block that Ceres holds constant gets no Jacobian, and the others stay as they are.
  for (size_t b = 0; b < J.size(); ++b) {
    std::vector<double*> without = J_pointers;
    without[b] = nullptr;
    const RowMajorXd before = J[(b + 1) % J.size()];
    EXPECT_TRUE(cost.Evaluate(pointers(values).data(), r.data(), without.data()));
    EXPECT_EQ(J[(b + 1) % J.size()], before);
  }
  return {J.begin(), J.end()};
}

/** The Jacobians that Ceres makes of Evaluate()'s, by the tangent of every block, against
 * differences along the manifold. */
inline void expectJacobians(const ceres::CostFunction& cost, const Values& values) {
  const std::vector<Eigen::MatrixXd> J = ambientJacobians(cost, values);
  const PoseManifold manifold;
  for (size_t b = 0; b < values.size(); ++b) {
    SCOPED_TRACE("block " + std::to_string(b));
    const bool pose = values[b].size() == 7;
    const auto at = [&](const Eigen::VectorXd& d) {
      Values other = values;
      if (pose)
        manifold.Plus(values[b].data(), d.data(), other[b].data());
      else
        other[b] += d;
      return residual(cost, other);
    };
    RowMajor<7, 6> plus;
    if (pose) manifold.PlusJacobian(values[b].data(), plus.data());
    const Eigen::MatrixXd by_tangent = pose ? Eigen::MatrixXd(J[b] * plus) : J[b];
    const Eigen::VectorXd here = Eigen::VectorXd::Zero(by_tangent.cols());
    expectJacobian(by_tangent, at, here);
  }
}

}  // namespace etalon::testing
