#include "etalon/initialization/steps/world_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "etalon/core/so3.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector11d = Eigen::Matrix<double, 11, 1>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

/** A window whose truth is expressed in V, the frame of its first body. */
struct InV {
  InV() : window(testing::makeSyntheticWindow(options())) {
    const SE3 T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& s : window.truth) {
      estimate.T_VB.push_back(T_VW * s.T_WB);
      estimate.v_VB.push_back(T_VW.R * s.v_WB);
    }
    estimate.g_V = T_VW.R * Vector3d(0, 0, -9.81);
    estimate.bias = window.bias;
    for (size_t id = 0; id < window.landmarks.size(); ++id)
      estimate.landmarks[static_cast<LandmarkId>(id)] = T_VW * window.landmarks[id];
  }
  static testing::SyntheticWindowOptions options() {
    testing::SyntheticWindowOptions o;
    o.motion = testing::Motion::kAggressive;
    o.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    return o;
  }
  Initialization aligned(const VisualFrameEstimate& e) const {
    return alignWithGravity(makeProblem(window, options()), e);
  }

  testing::SyntheticWindow window;
  VisualFrameEstimate estimate;
};

TEST(AlignWithGravity, TheTruthInVIsTheTruthInWBesidesYawAndPosition) {
  const InV c;
  const Initialization result = c.aligned(c.estimate);
  EXPECT_LT(result.states[0].T_WB.t.norm(), 1e-12);
  const testing::WindowErrors errors = errorsOf(result.states, result.bias, c.window);
  EXPECT_LT(errors.gravity_deg, 1e-5);  // an arc cosine near zero
  EXPECT_LT(errors.ate_m, 1e-9);
  EXPECT_LT(errors.velocity_mps, 1e-9);
  // Landmarks move with the poses.
  const SE3 T_WB0 = result.states[0].T_WB;
  for (const auto& [id, p_W] : result.landmarks)
    EXPECT_LT((T_WB0.inverse() * p_W - c.estimate.landmarks.at(id)).norm(), 1e-9);
  EXPECT_EQ(result.covariance.size(), 0);  // the estimate has none
}

TEST(AlignWithGravity, TurnsTheWorldByTheLeastAngle) {
  const InV c;
  const Initialization result = c.aligned(c.estimate);
  // V is the frame of the first body, so R_WV is its attitude; the least turn has a level axis.
  const Vector3d axis = logSO3(result.states[0].T_WB.R);
  EXPECT_NEAR(axis.z(), 0.0, 1e-12);
}

/** d(error in W) / d(error in V), by differences of what alignWithGravity() makes of it. */
TEST(CovarianceInWorld, IsTheDerivativeOfTheAlignment) {
  const InV c;
  const Vector11d none = testing::estimationError(c.aligned(c.estimate), c.window);
  EXPECT_LT(none.norm(), 1e-9);
  const auto errorBy = [&](const Vector12d& d) {
    VisualFrameEstimate e = c.estimate;
    e.bias.gyro += d.head<3>();
    e.bias.accel += d.segment<3>(3);
    e.g_V += d.segment<3>(6);
    e.v_VB.back() += d.tail<3>();
    return testing::estimationError(c.aligned(e), c.window);
  };
  const Initialization truth = c.aligned(c.estimate);
  const Matrix3d R_WV = truth.states[0].T_WB.R * c.estimate.T_VB[0].R.transpose();
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 12; ++i) {
    // Errors of gravity's magnitude are none of its direction: along g_V nothing may come out.
    const Vector12d unit = Vector12d::Unit(i);
    const Vector11d numerical = (errorBy(kStep * unit) - errorBy(-kStep * unit)) / (2.0 * kStep);
    const Eigen::MatrixXd P =
        covarianceInWorld(unit * unit.transpose(), R_WV, truth.states.back().v_WB, 9.81);
    EXPECT_LT((P - numerical * numerical.transpose()).norm(), 1e-6) << i;
  }
}

TEST(CovarianceInWorld, IsSymmetricToTheLastBit) {
  Eigen::Matrix<double, 12, 12> A;
  for (int i = 0; i < 144; ++i) A(i) = std::sin(1.0 + 0.7 * i);
  const Eigen::MatrixXd P =
      covarianceInWorld(A * A.transpose(), expSO3({0.3, -0.2, 1.0}), {1, 2, 3}, 9.81);
  EXPECT_EQ(P, P.transpose());
  EXPECT_EQ(P.rows(), 11);
}

TEST(CheckGravityDirection, SaysNoMoreThanHalfATurn) {
  EXPECT_TRUE(checkGravityDirection(0.08, 5.0));  // 4.6 deg
  const Expected<void> known = checkGravityDirection(0.1, 5.0);
  EXPECT_EQ(known.error().status, RefusalStatus::kIllConditioned);
  EXPECT_NEAR(*known.error().value, 5.7296, 1e-4);
  // What the joint system says of a direction that nothing determines.
  const Expected<void> nothing = checkGravityDirection(1e150, 5.0);
  EXPECT_EQ(nothing.error().reason,
            "the gravity direction is known to 180.00 deg (1 sigma), at most 5.00 is wanted");
}

TEST(CheckMeanSpecificForce, WantsATenthOfGravity) {
  EXPECT_TRUE(checkMeanSpecificForce(0.99, 9.81));
  const Expected<void> none = checkMeanSpecificForce(0.97, 9.81);
  EXPECT_EQ(none.error().status, RefusalStatus::kImplausible);
  EXPECT_EQ(*none.error().value, 0.97);
  EXPECT_NEAR(*none.error().bound, 0.981, 1e-12);
  EXPECT_FALSE(checkMeanSpecificForce(std::numeric_limits<double>::quiet_NaN(), 9.81));
}

}  // namespace
}  // namespace etalon
