#include "etalon/optimization/residuals/preintegration_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

const Vector3d kGravityInWorld(0, 0, -9.81);

/** A varied motion: rates and specific forces of a flying MAV, `scale` on the rates. */
std::vector<ImuSample> imuSamples(double duration_s, int steps, double scale) {
  std::vector<ImuSample> samples;
  for (int k = 0; k <= steps; ++k) {
    const double t = duration_s * k / steps;
    ImuSample s;
    s.t = durationNs(t);
    s.gyro = scale * Vector3d(std::sin(2 * t), 0.7 * std::cos(3 * t), -0.9 + 0.2 * t);
    s.accel = Vector3d(std::cos(t), 1.5 * std::sin(4 * t), 9.5 + std::sin(2 * t));
    samples.push_back(s);
  }
  return samples;
}

/** Arguments of the residual. */
struct Point {
  std::string name;
  Preintegration preintegration;
  SE3 T_WBi, T_WBj;
  Vector3d v_i, v_j, g_W = kGravityInWorld;
  ImuBias bias;

  Vector9d residual(PreintegrationJacobians* J = nullptr) const {
    return preintegrationResidual(preintegration, T_WBi, v_i, T_WBj, v_j, bias, g_W, J);
  }
};

/** A point whose residual is zero but for an error of the rotation, position and velocity at j. */
Point makePoint(const std::string& name, double duration_s, int steps, double rate_scale,
                const Matrix3d& R_WBi, const ImuBias& bias_change, const Vector9d& error) {
  const ImuBias integrated_at{{0.01, -0.02, 0.03}, {0.05, 0.1, -0.1}};
  Point x;
  x.name = name;
  x.preintegration =
      Preintegration(imuSamples(duration_s, steps, rate_scale), integrated_at, ImuNoiseDensities());
  x.bias = {integrated_at.gyro + bias_change.gyro, integrated_at.accel + bias_change.accel};
  x.T_WBi = SE3(R_WBi, Vector3d(1.0, -2.0, 0.5));
  x.v_i = Vector3d(0.8, -1.2, 0.3);
  const double dt = x.preintegration.dt();
  const Preintegration::Deltas d = x.preintegration.corrected(x.bias);
  x.T_WBj.R = R_WBi * d.dR * expSO3(error.head<3>());
  x.T_WBj.t = x.T_WBi.t + x.v_i * dt + 0.5 * dt * dt * x.g_W + R_WBi * (d.dp + error.segment<3>(3));
  x.v_j = x.v_i + x.g_W * dt + R_WBi * (d.dv + error.tail<3>());
  return x;
}

std::vector<Point> hardPoints() {
  const ImuBias none;
  const ImuBias large{{0.6, -0.4, 0.5}, {1.0, -2.0, 0.7}};
  const Matrix3d identity = Matrix3d::Identity();
  const Matrix3d attitude = expSO3({0.7, -1.1, 0.4});
  const Matrix3d upside_down = expSO3({M_PI, 0, 0});
  Vector9d zero = Vector9d::Zero(), some, tiny, quarter_turn, nearly_turned;
  some << 0.02, -0.03, 0.01, 0.1, 0.2, -0.1, 0.05, -0.3, 0.2;
  tiny << 1e-9, -2e-9, 1e-9, 0, 1e-9, 0, 1e-9, 0, 0;
  quarter_turn << 0.9, -0.9, 0.9, 1, 2, -1, 3, -2, 1;   // 1.56 rad
  nearly_turned << 1.7, 1.7, -1.7, 1, 2, -1, 3, -2, 1;  // 2.94 rad
  return {makePoint("identity", 0.25, 50, 0.0, identity, none, zero),
          makePoint("ordinary", 0.25, 50, 1.0, attitude, none, some),
          makePoint("tiny angle", 0.25, 50, 1.0, attitude, none, tiny),
          makePoint("upside down", 0.25, 50, 1.0, upside_down, none, some),
          makePoint("residual of a quarter turn", 0.25, 50, 1.0, attitude, none, quarter_turn),
          makePoint("residual of nearly half a turn", 0.25, 50, 1.0, attitude, none, nearly_turned),
          makePoint("large bias", 0.25, 50, 1.0, attitude, large, some),
          makePoint("large bias and residual", 1.0, 200, 1.0, attitude, large, quarter_turn),
          makePoint("long interval", 5.0, 1000, 1.0, attitude, none, some),
          makePoint("short interval", 0.001, 1, 1.0, attitude, none, some),
          makePoint("fast rotation", 0.25, 50, 12.0, attitude, none, some)};
}

/** d(residual) / d(member) of a point. */
template <typename Member, typename Derived>
void expectDerivative(const char* what, const Eigen::MatrixBase<Derived>& analytic, Point x,
                      Member* member(Point*)) {
  SCOPED_TRACE(x.name + ", " + what);
  // The differences' truncation, largest at the residual of nearly half a turn, where Log's
  // derivatives grow; in the other points it is below 1e-10.
  const Member here = *member(&x);
  const auto at = [&](const Member& value) {
    *member(&x) = value;
    return x.residual();
  };
  testing::expectJacobian(analytic, at, here);
}

TEST(PreintegrationResidual, JacobiansAgreeWithNumericalOnes) {
  for (const Point& x : hardPoints()) {
    PreintegrationJacobians J;
    const Vector9d with = x.residual(&J);
    EXPECT_EQ(with, x.residual()) << x.name;
    expectDerivative<SE3>("pose i", J.pose_i, x, [](Point* p) { return &p->T_WBi; });
    expectDerivative<SE3>("pose j", J.pose_j, x, [](Point* p) { return &p->T_WBj; });
    expectDerivative<Vector3d>("velocity i", J.velocity_i, x, [](Point* p) { return &p->v_i; });
    expectDerivative<Vector3d>("velocity j", J.velocity_j, x, [](Point* p) { return &p->v_j; });
    expectDerivative<Vector3d>("b_g", J.bias_gyro, x, [](Point* p) { return &p->bias.gyro; });
    expectDerivative<Vector3d>("b_a", J.bias_accel, x, [](Point* p) { return &p->bias.accel; });
    expectDerivative<Vector3d>("gravity", J.gravity, x, [](Point* p) { return &p->g_W; });
  }
}

TEST(PreintegrationResidual, IsTheErrorOfTheSecondState) {
  Vector9d error;
  error << 0.02, -0.03, 0.01, 0.1, 0.2, -0.1, 0.05, -0.3, 0.2;
  const ImuBias bias_change{{0.02, 0.01, -0.03}, {0.1, 0.2, 0.3}};
  const Point x = makePoint("", 0.25, 50, 1.0, expSO3({0.7, -1.1, 0.4}), bias_change, error);
  EXPECT_LT((x.residual() - error).norm(), 1e-14);  // rounding
  const Point consistent =
      makePoint("", 0.25, 50, 1.0, expSO3({0.7, -1.1, 0.4}), bias_change, Vector9d::Zero());
  EXPECT_LT(consistent.residual().norm(), 1e-14);
}

TEST(PreintegrationResidual, DoesNotChangeWithYawOrOrigin) {
  Vector9d error;
  error << 0.02, -0.03, 0.01, 0.1, 0.2, -0.1, 0.05, -0.3, 0.2;
  const Point x = makePoint("", 0.25, 50, 1.0, expSO3({0.7, -1.1, 0.4}), {}, error);
  const SE3 T_WnewW(expSO3({0, 0, 2.1}), Vector3d(10, -20, 5));
  Point moved = x;
  moved.T_WBi = T_WnewW * x.T_WBi;
  moved.T_WBj = T_WnewW * x.T_WBj;
  moved.v_i = T_WnewW.R * x.v_i;
  moved.v_j = T_WnewW.R * x.v_j;
  EXPECT_LT((moved.residual() - x.residual()).norm(), 1e-13);  // rounding of metres
}

TEST(SqrtInformation, WhitensTheCovariance) {
  for (const Point& x : hardPoints()) {
    const Matrix9d L = sqrtInformation(x.preintegration);
    EXPECT_TRUE(L.isLowerTriangular(0.0)) << x.name;
    const Matrix9d white = L * x.preintegration.covariance9() * L.transpose();
    // L^T L = covariance^-1 means L covariance L^T = I; rounding times a condition below 1e6.
    EXPECT_LT((white - Matrix9d::Identity()).norm(), 1e-9) << x.name;
  }
}

TEST(SqrtInformation, RefusesACovarianceThatCannotBeInverted) {
  EXPECT_THROW(sqrtInformation(Preintegration()), DataError);
  ImuNoiseDensities none;
  none.gyro_noise_density = none.gyro_random_walk = 0.0;
  none.accel_noise_density = none.accel_random_walk = 0.0;
  EXPECT_THROW(sqrtInformation(Preintegration(imuSamples(0.25, 50, 1.0), {}, none)), DataError);
  none.accel_noise_density = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(sqrtInformation(Preintegration(imuSamples(0.25, 50, 1.0), {}, none)), DataError);
}

}  // namespace
}  // namespace etalon
