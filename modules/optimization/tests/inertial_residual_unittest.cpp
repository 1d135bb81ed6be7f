#include "etalon/optimization/residuals/inertial_residual.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Vector15d = Eigen::Matrix<double, 15, 1>;

const Vector3d kGravity(0, 0, -9.81);

Preintegration someMotion(double duration_s) {
  std::vector<ImuSample> samples;
  for (int k = 0; k <= 50; ++k) {
    const double t = duration_s * k / 50;
    ImuSample s;
    s.t = durationNs(t);
    s.gyro = Vector3d(std::sin(2 * t), 0.7 * std::cos(3 * t), -0.9 + 0.2 * t);
    s.accel = Vector3d(std::cos(t), 1.5 * std::sin(4 * t), 9.5 + std::sin(2 * t));
    samples.push_back(s);
  }
  ImuNoiseDensities noise;
  noise.gyro_noise_density = 1.7e-4;
  noise.gyro_random_walk = 2e-5;
  noise.accel_noise_density = 2e-3;
  noise.accel_random_walk = 3e-3;
  return Preintegration(samples, {{0.01, -0.02, 0.03}, {0.05, 0.1, -0.1}}, noise);
}

NavState someState() {
  NavState state;
  state.T_WB = {expSO3({0.7, -1.1, 0.4}), {1.0, -2.0, 0.5}};
  state.v_WB = {0.8, -1.2, 0.3};
  state.bias = {{0.02, -0.025, 0.03}, {0.1, 0.1, -0.2}};
  return state;
}

TEST(InertialResidual, IsZeroAtThePrediction) {
  const Preintegration imu = someMotion(0.5);
  const NavState start = someState();
  const NavState end = imu.predict(start, kGravity);
  EXPECT_LT(inertialResidual(imu, start, end, kGravity).norm(), 1e-12);
}

TEST(InertialResidual, PlusAndMinusAreInverse) {
  Vector15d d;
  d << 0.3, -0.2, 0.5, 1, 2, 3, -1, -2, -3, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  EXPECT_LT((someState().plus(d).minus(someState()) - d).norm(), 1e-12);
}

TEST(InertialResidual, JacobiansAgreeWithDifferences) {
  const Preintegration imu = someMotion(0.5);
  const NavState i = someState();
  Vector15d error;
  error << 0.02, -0.03, 0.01, 0.1, 0.2, -0.1, 0.05, -0.3, 0.2, 1e-3, 2e-3, -1e-3, 0.01, 0.02, 0.03;
  const NavState j = imu.predict(i, kGravity).plus(error);
  Matrix15d J_i, J_j, N_i, N_j;
  inertialResidual(imu, i, j, kGravity, &J_i, &J_j);
  const double h = 1e-5;
  for (int c = 0; c < 15; ++c) {
    const Vector15d d = h * Vector15d::Unit(c);
    N_i.col(c) = (inertialResidual(imu, i.plus(d), j, kGravity) -
                  inertialResidual(imu, i.plus(-d), j, kGravity)) /
                 (2 * h);
    N_j.col(c) = (inertialResidual(imu, i, j.plus(d), kGravity) -
                  inertialResidual(imu, i, j.plus(-d), kGravity)) /
                 (2 * h);
  }
  // Differences of step h err by h^2 of the third derivative, and by rounding over h.
  EXPECT_LT((J_i - N_i).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((J_j - N_j).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(InertialResidual, WhiteningInvertsTheJointCovariance) {
  const Preintegration imu = someMotion(0.05);
  const Matrix15d L = inertialSqrtInformation(imu);
  EXPECT_LT((L * imu.covariance() * L.transpose() - Matrix15d::Identity()).norm(), 1e-8);
  EXPECT_THROW(inertialSqrtInformation(Preintegration()), DataError);
}

}  // namespace
}  // namespace etalon
