#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/so3.h"
#include "etalon/initialization/joint/joint_system.h"

namespace etalon {

using Vector12 = Eigen::Matrix<double, 12, 1>;  // [v_0, b_g, b_a, g]

/** Keyframes at their true poses. What the tracks say of the poses, S and s, is drawn. */
struct JointCase {
  explicit JointCase(int keyframes = 4, const SlowAcceleration& slow = {})
      : problem(contractProblem(keyframes, slow)), estimate(trueEstimate()) {
    motion = composeMotion(problem.preintegrate(estimate.bias), slow);
    const Eigen::Index n = 6 * (problem.keyframeCount() - 1);
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto draw = [&] { return normal(random); };
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, draw);
    S = 1e5 * (A * A.transpose() + Eigen::MatrixXd::Identity(n, n));
    // The cameras see the poses a centimetre and some hundredths of a radian elsewhere.
    s = S * (0.01 * Eigen::VectorXd::NullaryExpr(n, draw));
  }

  InitializationProblem contractProblem(int keyframes, const SlowAcceleration& slow) {
    testing::SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.keyframes = keyframes;
    options.landmarks = 20;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    options.priors = {options.bias, 0.1, 0.1, slow};
    options.priors.mean.accel.x() += 0.05;
    window = testing::makeSyntheticWindow(options);
    return testing::makeProblem(window, options);
  }
  JointEstimate trueEstimate() const {
    JointEstimate result;
    result.bias = window.bias;
    for (const StampedState& state : window.truth)
      result.T_VB.push_back(window.truth[0].T_WB.inverse() * state.T_WB);
    result.T_SS = result.T_VB;
    return result;
  }

  /** Where the IMU carries the nodes from x, less the estimate's poses: 6 a node. */
  Eigen::VectorXd carried(const Vector12& x) const {
    Eigen::VectorXd y(S.rows());
    for (size_t k = 1; k < motion.nodes.size(); ++k) {
      const ClosedFormMotion::Node& node = motion.nodes[k];
      const Eigen::Matrix<double, 9, 1> by_bias = node.bias * x.segment<6>(3);
      y.segment<3>(6 * (k - 1)) =
          logSO3(estimate.T_VB[k].R.transpose() * node.R_VB) + by_bias.head<3>();
      y.segment<3>(6 * (k - 1) + 3) = node.alpha + node.t * x.head<3>() +
                                      0.5 * node.t * node.t * x.tail<3>() + by_bias.segment<3>(3) -
                                      estimate.T_VB[k].t;
    }
    return y;
  }
  /** Sigma: of the nodes' poses. */
  Eigen::MatrixXd imuCovariance() const {
    Eigen::MatrixXd result(S.rows(), S.rows());
    for (Eigen::Index i = 0; i < S.rows() / 6; ++i)
      for (Eigen::Index j = 0; j < S.rows() / 6; ++j)
        result.block<6, 6>(6 * i, 6 * j) = motion.covariance.block<6, 6>(9 * i, 9 * j);
    return result;
  }
  /** The cost as the class states it, by inverting what the class never inverts. */
  double cost(const Vector12& x) const {
    const Eigen::MatrixXd S_inverse = S.inverse();
    const Eigen::VectorXd r = carried(x) - S_inverse * s;
    const BiasPriors& priors = problem.priors();
    const Eigen::Vector3d gyro = estimate.bias.gyro + x.segment<3>(3) - priors.mean.gyro;
    const Eigen::Vector3d accel = estimate.bias.accel + x.segment<3>(6) - priors.mean.accel;
    return r.dot((S_inverse + imuCovariance()).inverse() * r) +
           gyro.squaredNorm() / std::pow(priors.sigma_gyro_rps, 2) +
           accel.squaredNorm() / std::pow(priors.sigma_accel_mps2, 2);
  }

  testing::SyntheticWindow window;
  InitializationProblem problem;
  JointEstimate estimate;
  ClosedFormMotion motion;
  Eigen::MatrixXd S;
  Eigen::VectorXd s;
};

}  // namespace etalon
