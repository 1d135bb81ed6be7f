#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "etalon/core/so3.h"
#include "etalon/initialization/joint/closed_form_motion.h"
#include "etalon/testing/consistency.h"
#include "etalon/testing/noisy_window.h"

namespace etalon::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using etalon::ClosedFormMotion;

/** Composed less true [rotation, alpha, beta] of all nodes but the first. */
VectorXd motionErrors(const NoisyWindow& w, const ClosedFormMotion& motion) {
  constexpr Index kError = ClosedFormMotion::kError;
  VectorXd e(kError * (motion.nodes.size() - 1));
  for (size_t k = 1; k < motion.nodes.size(); ++k) {
    const ClosedFormMotion::Node& node = motion.nodes[k];
    e.segment<kError>(kError * (k - 1)) << logSO3(w.T_VB[k].R.transpose() * node.R_VB),
        node.alpha - (w.T_VB[k].t - w.v_VB[0] * node.t - 0.5 * node.t * node.t * w.g_V),
        node.beta - (w.v_VB[k] - w.v_VB[0] - node.t * w.g_V);
  }
  return e;
}

TEST(ClosedFormMotion, NodesErrJointlyAsTheirCovarianceSays) {
  WhiteSample sample;
  for (int run = 0; run < 400; ++run) {
    SyntheticWindowOptions options = imuOnly(run);
    options.keyframes = 4;
    const NoisyWindow w(options);
    const ClosedFormMotion motion = composeMotion(w.preintegrations);
    const VectorXd e = motionErrors(w, motion);
    sample.add(motion.covariance.llt().matrixL().solve(e));
  }
  expectWhite(sample);
}

TEST(ClosedFormMotion, BiasJacobianAgreesWithDifferences) {
  const NoisyWindow w(imuOnly(1));
  const ClosedFormMotion at = composeMotion(w.preintegrations);
  constexpr double kStep = 1e-5;
  for (int a = 0; a < 6; ++a) {
    VectorXd side[2];
    for (int s = 0; s < 2; ++s) {
      ImuBias bias = w.bias;
      (a < 3 ? bias.gyro : bias.accel)[a % 3] += s ? kStep : -kStep;
      side[s] = motionErrors(w, composeMotion(w.preintegrate(bias)));
    }
    for (size_t k = 1; k < at.nodes.size(); ++k) {
      const Index i = 9 * (k - 1);
      const VectorXd numerical = (side[1] - side[0]).segment<9>(i) / (2.0 * kStep);
      // The midpoint's derivative within a step is of second order in the step as well.
      EXPECT_LT((numerical - at.nodes[k].bias.col(a)).norm(), 1e-3 * (1.0 + numerical.norm()));
    }
  }
}

}  // namespace
}  // namespace etalon::testing
