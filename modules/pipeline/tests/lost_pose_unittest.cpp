#include "etalon/pipeline/lost_pose.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/** 2 m/s, known to 0.5 m/s in all; the pose to 0.1 m and 0.01 rad along each axis. */
LostPose lostInFlight() {
  NavState state;
  state.v_WB = {0.0, -2.0, 0.0};
  Eigen::Matrix<double, 15, 1> sigma = Eigen::Matrix<double, 15, 1>::Constant(1e-3);
  sigma.head<3>().setConstant(0.01);
  sigma.segment<3>(3).setConstant(0.1);
  sigma.segment<3>(6) << 0.3, 0.4, 0.0;
  return {state, Matrix15d(sigma.cwiseAbs2().asDiagonal())};
}

TEST(LostPose, IsAsTheOdometryHadItWhereImagesGoOn) {
  const Matrix6d P = lostInFlight().covariance(expSO3({0.1, 0.2, 0.3}));
  EXPECT_NEAR(P(0, 0), 1e-4, 1e-15);
  EXPECT_NEAR(P(5, 5), 1e-2, 1e-15);
}

TEST(LostPose, MayHaveGoneAsFarAsItsSpeedTakesItInTheTimeWithoutImages) {
  LostPose lost = lostInFlight();
  lost.goBlind(3.0, true);
  lost.goBlind(1.0, true);
  const Matrix6d P = lost.covariance(expSO3({0.1, 0.2, 0.3}));
  for (int i = 3; i < 6; ++i) EXPECT_NEAR(P(i, i), 1e-2 + 2.5 * 2.5 * 4.0 * 4.0, 1e-9);
  EXPECT_NEAR(P(0, 0), 1e-4, 1e-15);  // the gyro has seen the turns
}

TEST(LostPose, MayHaveTurnedAboutTheVerticalWhereTheGyroIsMissing) {
  LostPose lost = lostInFlight();
  lost.goBlind(0.2, false);
  const Eigen::Matrix3d R = expSO3({0.3, -0.5, 1.0});
  // In the body's axes at the covariance, in the world's here.
  const auto turned = [&R](const LostPose& pose) {
    return Eigen::Matrix3d(R * pose.covariance(R).topLeftCorner<3, 3>() * R.transpose());
  };
  EXPECT_LT((turned(lost) - Eigen::Matrix3d(Vector3d(1e-4, 1e-4, 1e-4 + 0.01).asDiagonal())).norm(),
            1e-12);
  // However long: yaw is unknown, and no more than that.
  lost.goBlind(1e6, false);
  EXPECT_NEAR(std::sqrt(turned(lost)(2, 2)), M_PI / std::sqrt(3.0), 0.02);
}

}  // namespace
}  // namespace etalon
