#include "etalon/initialization/joint/closed_form_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/expect_jacobian.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using Node = ClosedFormMotion::Node;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

struct Case {
  Case() {
    SyntheticWindowOptions options;
    options.motion = Motion::kAggressive;
    options.keyframes = 6;
    options.bias = bias = testing::kBiases;
    window = testing::makeSyntheticWindow(options);
    noise = window.calibration.imu.noise;
    // An interval does not hand the bias at its end on to the next one. Without random walk the
    // intervals together equal one long interval.
    noise.gyro_random_walk = noise.accel_random_walk = 0.0;
  }
  std::vector<Preintegration> preintegrations(const ImuBias& at) const {
    std::vector<Preintegration> result;
    for (size_t k = 1; k < window.truth.size(); ++k)
      result.emplace_back(window.imu.between(window.truth[k - 1].t, window.truth[k].t), at, noise);
    return result;
  }
  SyntheticWindow window;
  ImuNoiseDensities noise;
  ImuBias bias;
};

/** `b` less `a` as [rotation (right perturbation), alpha, beta]. */
Vector9 difference(const Node& a, const Node& b) {
  Vector9 d;
  d << logSO3(a.R_VB.transpose() * b.R_VB), b.alpha - a.alpha, b.beta - a.beta;
  return d;
}

TEST(ClosedFormMotion, IsTheTrueMotionAtTheTrueBiases) {
  const Case c;
  const ClosedFormMotion motion = composeMotion(c.preintegrations(c.bias));
  const SE3 T_VW = c.window.truth[0].T_WB.inverse();
  const Vector3d v_0 = T_VW.R * c.window.truth[0].v_WB, g = T_VW.R * Vector3d(0, 0, -9.81);
  ASSERT_EQ(motion.nodes.size(), c.window.truth.size());
  for (size_t k = 0; k < motion.nodes.size(); ++k) {
    const Node& node = motion.nodes[k];
    const SE3 T_VB = T_VW * c.window.truth[k].T_WB;
    EXPECT_NEAR(node.t, 0.25 * static_cast<double>(k), 1e-9);
    EXPECT_LT((node.R_VB - T_VB.R).norm(), 1e-10);
    EXPECT_LT((v_0 * node.t + 0.5 * node.t * node.t * g + node.alpha - T_VB.t).norm(), 1e-8);
    EXPECT_LT((v_0 + node.t * g + node.beta - T_VW.R * c.window.truth[k].v_WB).norm(), 1e-8);
  }
}

TEST(ClosedFormMotion, IsOneLongPreintegration) {
  const Case c;
  const ClosedFormMotion motion = composeMotion(c.preintegrations(c.bias));
  const Preintegration whole(
      c.window.imu.between(c.window.truth.front().t, c.window.truth.back().t), c.bias, c.noise);
  const Node& last = motion.nodes.back();
  EXPECT_LT((last.R_VB - whole.deltas().dR).norm(), 1e-10);
  EXPECT_LT((last.alpha - whole.deltas().dp).norm(), 1e-9);
  EXPECT_LT((last.beta - whole.deltas().dv).norm(), 1e-9);
  const Matrix9 covariance = motion.covariance.bottomRightCorner<9, 9>();
  EXPECT_LT((covariance - whole.covariance9()).norm(), 1e-6 * covariance.norm());
  for (int i = 0; i < 9; ++i)  // the small ones, too: rotation is 1e-3 of position
    EXPECT_NEAR(covariance(i, i), whole.covariance9()(i, i), 1e-4 * covariance(i, i));
}

TEST(ClosedFormMotion, BiasJacobiansAreThoseByNumericalDerivatives) {
  const Case c;
  const ClosedFormMotion motion = composeMotion(c.preintegrations(c.bias));
  Eigen::Matrix<double, 6, 1> bias;
  bias << c.bias.gyro, c.bias.accel;
  for (size_t k = 1; k < motion.nodes.size(); ++k) {
    const MatrixXd numerical = testing::numericalJacobian(
        [&](const Eigen::Matrix<double, 6, 1>& b) {
          const ImuBias moved{b.head<3>(), b.tail<3>()};
          return difference(motion.nodes[k], composeMotion(c.preintegrations(moved)).nodes[k]);
        },
        bias, 1e-4);
    // The Jacobians are those of the continuous motion, but the samples are 5 ms apart.
    for (int i = 0; i < 6; ++i)
      EXPECT_LT((motion.nodes[k].bias.col(i) - numerical.col(i)).norm(),
                1e-3 * numerical.col(i).norm());
  }
}

TEST(ClosedFormMotion, JointCovarianceHandsAnErrorOnToAllLaterNodes) {
  const Case c;
  const std::vector<Preintegration> preintegrations = c.preintegrations(c.bias);
  const ClosedFormMotion motion = composeMotion(preintegrations);
  const Index n = 9 * (motion.nodes.size() - 1);
  ASSERT_EQ(motion.covariance.rows(), n);
  EXPECT_LT((motion.covariance - motion.covariance.transpose()).norm(),
            1e-12 * motion.covariance.norm());
  EXPECT_GT(symmetricEigenvalues(motion.covariance)(0), 0.0);

  // Carries an error of node 2 on to a later node by the equations of motion.
  const auto carried = [&](const Vector9& error, size_t to) {
    Node node = motion.nodes[2];
    node.R_VB = node.R_VB * expSO3(error.head<3>());
    node.alpha += error.segment<3>(3);
    node.beta += error.tail<3>();
    for (size_t k = 2; k < to; ++k) {
      const Preintegration& p = preintegrations[k];
      node.alpha += node.beta * p.dt() + node.R_VB * p.deltas().dp;
      node.beta += node.R_VB * p.deltas().dv;
      node.R_VB = node.R_VB * p.deltas().dR;
    }
    return difference(motion.nodes[to], node);
  };
  const Matrix9 at_2 = motion.covariance.block<9, 9>(9, 9);
  for (size_t k = 3; k < motion.nodes.size(); ++k) {
    const Vector9 none = Vector9::Zero();
    const MatrixXd F = testing::numericalJacobian(
        [&](const Vector9& error) { return carried(error, k); }, none, 1e-5);
    const Matrix9 across = motion.covariance.block<9, 9>(9 * (k - 1), 9);  // node k, node 2
    EXPECT_LT((across - F * at_2).norm(), 1e-7 * across.norm());
  }
}

/** An interval's factor scales what its white noise makes, of which there is a root. */
TEST(ClosedFormMotion, WhiteNoiseOfTheAccelerometerGrowsByItsFactors) {
  Case c;
  const std::vector<Preintegration> preintegrations = c.preintegrations(c.bias);
  Eigen::VectorXd factors(preintegrations.size());
  factors << 1.5, 1.0, 3.0, 2.0, 1.0;
  const ClosedFormMotion grown = composeMotion(preintegrations, {}, factors);
  std::vector<Preintegration> noisier;
  for (size_t k = 0; k < preintegrations.size(); ++k) {
    ImuNoiseDensities noise = c.noise;
    noise.accel_noise_density *= factors[k];
    noisier.emplace_back(preintegrations[k].samples(), c.bias, noise);
  }
  const auto expectNear = [](const MatrixXd& P, const MatrixXd& expected) {
    ASSERT_EQ(P.rows(), expected.rows());
    for (Index i = 0; i < P.rows(); ++i)
      for (Index j = 0; j < P.rows(); ++j)
        EXPECT_NEAR(P(i, j), expected(i, j), 1e-3 * std::sqrt(expected(i, i) * expected(j, j)));
  };
  expectNear(grown.covariance, composeMotion(noisier).covariance);

  c.noise.accel_noise_density = 0.0;
  const MatrixXd calm = composeMotion(c.preintegrations(c.bias)).covariance;
  std::vector<Index> positions;
  for (Index row = 0; row < calm.rows(); ++row)
    if (row % 9 / 3 == 1) positions.push_back(row);
  expectNear(grown.white_accel_root * grown.white_accel_root.transpose(),
             (grown.covariance - calm)(positions, positions));
}

/** An error that never changes is one of the bias; one that is new at every interval is less of it
 * at the end. */
TEST(ClosedFormMotion, ASlowErrorLiesBetweenABiasAndNoise) {
  const Case c;
  const std::vector<Preintegration> preintegrations = c.preintegrations(c.bias);
  const ClosedFormMotion plain = composeMotion(preintegrations);
  const auto added = [&](double time_s) -> MatrixXd {
    return composeMotion(preintegrations, {0.03, time_s}).covariance - plain.covariance;
  };
  const Index n = plain.covariance.rows();
  MatrixXd by_bias(n, 3);
  for (Index row = 0; row < n; row += 9)
    by_bias.middleRows<9>(row) = plain.nodes[row / 9 + 1].bias.rightCols<3>();
  const MatrixXd of_bias = 0.03 * 0.03 * by_bias * by_bias.transpose();
  EXPECT_LT((added(1e9) - of_bias).norm(), 1e-8 * of_bias.norm());
  const auto last = [](const MatrixXd& P) { return P.bottomRightCorner<3, 3>().trace(); };
  EXPECT_LT(last(added(0.5)), 0.8 * last(of_bias));
  EXPECT_LT(last(added(1e-3)), 0.5 * last(added(0.5)));
  EXPECT_GT(last(added(1e-3)), 0.0);
}

}  // namespace
}  // namespace etalon
