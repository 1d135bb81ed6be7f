#include "etalon/imu/preintegration.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "analytic_motion.h"
#include "etalon/core/errors.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr TimeNs kMillisecond = 1'000'000;
constexpr TimeNs kStart = 1'403'636'579'763'555'584;  // a EuRoC stamp: a double could not hold it

struct DeltaErrors {
  double rotation, velocity, position;  // rad, m/s, m
};

DeltaErrors difference(const Preintegration::Deltas& a, const Preintegration::Deltas& b) {
  return {logSO3(a.dR.transpose() * b.dR).norm(), (a.dv - b.dv).norm(), (a.dp - b.dp).norm()};
}

Preintegration integrate(const std::vector<ImuSample>& samples, const ImuBias& bias = {}) {
  return Preintegration(samples, bias, ImuNoiseDensities());
}

TEST(Preintegration, IsIdentityByDefault) {
  const Preintegration empty;
  EXPECT_EQ(empty.dt(), 0.0);
  EXPECT_TRUE(empty.deltas().dR.isIdentity(0.0));
  EXPECT_TRUE(empty.covariance().isZero(0.0));
}

TEST(Preintegration, RefusesBrokenSamples) {
  const std::vector<ImuSample> good =
      AnalyticMotion().samples(evenStamps(kStart, 5 * kMillisecond, 3));
  EXPECT_NO_THROW(integrate(good));
  EXPECT_THROW(integrate({}), DataError);
  EXPECT_THROW(integrate({good[0]}), DataError);
  EXPECT_THROW(integrate({good[0], good[0]}), DataError);
  EXPECT_THROW(integrate({good[0], good[2], good[1]}), DataError);
  std::vector<ImuSample> broken = good;
  broken[1].gyro.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(integrate(broken), DataError);
  broken = good;
  broken[3].accel.x() = std::numeric_limits<double>::infinity();
  try {
    integrate(broken);
    FAIL() << "an infinite acceleration was accepted";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(broken[3].t)), std::string::npos);
  }
}

TEST(Preintegration, ConstantRateIsExact) {
  const Vector3d rate(0.7, -1.9, 2.3), b_g(0.01, 0.02, -0.03);
  std::vector<ImuSample> samples;
  for (TimeNs t : unevenStamps(kStart, 5 * kMillisecond, 200, 1))
    samples.push_back({t, rate + b_g, Vector3d::Zero()});
  const Preintegration p = integrate(samples, {b_g, Vector3d::Zero()});
  // Rounding of 200 products only.
  EXPECT_TRUE(p.deltas().dR.isApprox(expSO3(rate * p.dt()), 1e-13));
  EXPECT_LT((p.deltas().dR.transpose() * p.deltas().dR - Matrix3d::Identity()).norm(), 1e-13);
  EXPECT_TRUE(p.deltas().dv.isZero(0.0));
  EXPECT_TRUE(p.deltas().dp.isZero(0.0));
}

TEST(Preintegration, ConstantAccelerationIsExactWhileRotating) {
  // Acceleration constant in B0, the body turning at a constant rate: both parts of the scheme are
  // exact then.
  const Vector3d rate(1.1, 0.4, -2.0), accel_B0(0.5, -9.0, 3.0), b_a(0.1, -0.2, 0.05);
  std::vector<ImuSample> samples;
  for (TimeNs t : unevenStamps(kStart, 5 * kMillisecond, 200, 2))
    samples.push_back({t, rate, expSO3(-rate * secondsBetween(kStart, t)) * accel_B0 + b_a});
  const Preintegration p = integrate(samples, {Vector3d::Zero(), b_a});
  const double dt = p.dt();
  EXPECT_LT((p.deltas().dv - accel_B0 * dt).norm(), 1e-12);
  EXPECT_LT((p.deltas().dp - 0.5 * accel_B0 * dt * dt).norm(), 1e-12);
}

DeltaErrors integrationError(TimeNs step) {
  const AnalyticMotion motion;
  const TimeNs start = 317 * kMillisecond, end = start + 1000 * kMillisecond;
  const Preintegration p =
      integrate(motion.samples(evenStamps(start, step, static_cast<int>((end - start) / step))));
  return difference(p.deltas(), motion.deltas(start, end));
}

TEST(Preintegration, ConvergesWithSecondOrder) {
  const DeltaErrors at200 = integrationError(5 * kMillisecond);
  const DeltaErrors at400 = integrationError(5 * kMillisecond / 2);
  const DeltaErrors at1000 = integrationError(kMillisecond);
  // Local errors f'' h^3/12 with rates' and accelerations' second derivatives below 10 and 100 in
  // SI units, over 1 s.
  EXPECT_LT(at200.rotation, 2.5e-5);
  EXPECT_LT(at200.velocity, 2.5e-4);
  EXPECT_LT(at200.position, 2.5e-4);
  // Halving the step divides the error by 4, a fifth by 25; 5 % leave room for the next order.
  for (auto part : {&DeltaErrors::rotation, &DeltaErrors::velocity, &DeltaErrors::position}) {
    EXPECT_NEAR(at200.*part / at400.*part, 4.0, 0.2);
    EXPECT_NEAR(at200.*part / at1000.*part, 25.0, 1.25);
  }
}

TEST(Preintegration, PredictsTheStateOfAnAnalyticFlight) {
  const AnalyticMotion motion;
  const Preintegration p =
      integrate(motion.samples(evenStamps(200 * kMillisecond, kMillisecond, 500)));
  const double dt = p.dt();
  const Matrix3d R = motion.R_WB(0.2) * p.deltas().dR;
  const Vector3d v = motion.position(0.2, 1) + motion.g_W * dt + motion.R_WB(0.2) * p.deltas().dv;
  const Vector3d x = motion.position(0.2) + motion.position(0.2, 1) * dt +
                     0.5 * motion.g_W * dt * dt + motion.R_WB(0.2) * p.deltas().dp;
  // The integration's own error at 1000 Hz.
  EXPECT_LT(logSO3(R.transpose() * motion.R_WB(0.7)).norm(), 1e-6);
  EXPECT_LT((v - motion.position(0.7, 1)).norm(), 1e-5);
  EXPECT_LT((x - motion.position(0.7)).norm(), 1e-5);
}

struct HardInterval {
  std::string name;
  std::vector<TimeNs> stamps;
  double intensity;  // of the rotation
  ImuBias bias;
};

std::vector<HardInterval> hardIntervals() {
  const ImuBias none, ordinary{{0.02, -0.03, 0.01}, {0.1, 0.05, -0.2}};
  const ImuBias large{{0.8, -0.5, 0.6}, {2.0, -3.0, 1.0}};
  return {{"zero bias", evenStamps(0, 5 * kMillisecond, 50), 1.0, none},
          {"ordinary", evenStamps(0, 5 * kMillisecond, 50), 1.0, ordinary},
          {"uneven", unevenStamps(0, 5 * kMillisecond, 60, 3), 1.0, ordinary},
          {"large bias", evenStamps(0, 5 * kMillisecond, 50), 1.0, large},
          {"one tiny step", evenStamps(0, 1000, 1), 1.0, ordinary},
          {"long", evenStamps(0, 5 * kMillisecond, 1000), 1.0, ordinary},
          {"at rest", evenStamps(0, 5 * kMillisecond, 50), 0.0, none},
          {"fast rotation", evenStamps(0, 5 * kMillisecond, 50), 15.0, ordinary}};
}

/** Columns: derivative of a 3-vector function of the bias change, central differences. */
Matrix3d numericalDerivative(const std::function<Vector3d(const Vector3d&)>& f) {
  constexpr double kStep =
      1e-5;  // rounding 1e-16/1e-5, truncation (1e-5)^2: both below 1e-9 relative
  Matrix3d D;
  for (int i = 0; i < 3; ++i) {
    const Vector3d d = kStep * Vector3d::Unit(i);
    D.col(i) = (f(d) - f(-d)) / (2.0 * kStep);
  }
  return D;
}

void expectClose(const Matrix3d& analytic, const Matrix3d& numerical, const std::string& what) {
  // Relative to the whole block; where truth is zero, rounding of the differences remains.
  const double tolerance = 1e-7 * numerical.norm() + 1e-15;
  EXPECT_LT((analytic - numerical).norm(), tolerance) << what << "\nanalytic\n"
                                                      << analytic << "\nnumerical\n"
                                                      << numerical;
}

TEST(Preintegration, BiasJacobiansAgreeWithNumericalOnes) {
  for (const HardInterval& c : hardIntervals()) {
    AnalyticMotion motion;
    motion.intensity = c.intensity;
    const Preintegration p = integrate(motion.samples(c.stamps), c.bias);
    const auto gyroMoved = [&](const Vector3d& d) {
      return p.reintegrated({c.bias.gyro + d, c.bias.accel}).deltas();
    };
    const auto accelMoved = [&](const Vector3d& d) {
      return p.reintegrated({c.bias.gyro, c.bias.accel + d}).deltas();
    };
    expectClose(p.dR_dbg(), numericalDerivative([&](const Vector3d& d) {
                  return logSO3(p.deltas().dR.transpose() * gyroMoved(d).dR);
                }),
                c.name + ", dR_dbg");
    expectClose(p.dv_dbg(), numericalDerivative([&](const Vector3d& d) { return gyroMoved(d).dv; }),
                c.name + ", dv_dbg");
    expectClose(p.dp_dbg(), numericalDerivative([&](const Vector3d& d) { return gyroMoved(d).dp; }),
                c.name + ", dp_dbg");
    expectClose(p.dv_dba(),
                numericalDerivative([&](const Vector3d& d) { return accelMoved(d).dv; }),
                c.name + ", dv_dba");
    expectClose(p.dp_dba(),
                numericalDerivative([&](const Vector3d& d) { return accelMoved(d).dp; }),
                c.name + ", dp_dba");
  }
}

TEST(Preintegration, CorrectionErrorIsOfSecondOrder) {
  const AnalyticMotion motion;
  const ImuBias bias{{0.02, -0.03, 0.01}, {0.1, 0.05, -0.2}};
  const Preintegration p = integrate(motion.samples(evenStamps(0, 5 * kMillisecond, 50)), bias);
  const auto error = [&](double scale) {
    const ImuBias moved{bias.gyro + scale * Vector3d(0.02, 0.05, -0.03),
                        bias.accel + scale * Vector3d(0.3, -0.2, 0.1)};
    return difference(p.corrected(moved), p.reintegrated(moved).deltas());
  };
  const DeltaErrors whole = error(1.0), half = error(0.5);
  // Halving the change divides the error by 4; 5 % leave room for the third order.
  for (auto part : {&DeltaErrors::rotation, &DeltaErrors::velocity, &DeltaErrors::position})
    EXPECT_NEAR(whole.*part / half.*part, 4.0, 0.2);
  // |d_bg|^2 dt^2 / 2 bounds the rotation's, 0.06 rad/s over 0.25 s.
  EXPECT_LT(whole.rotation, 1.2e-4);
  const DeltaErrors unmoved = error(0.0);
  EXPECT_EQ(unmoved.velocity, 0.0);
  EXPECT_EQ(unmoved.position, 0.0);
  EXPECT_LT(unmoved.rotation, 1e-15);
}

TEST(Preintegration, ReintegrationEqualsIntegrationAtThatBias) {
  const std::vector<ImuSample> samples =
      AnalyticMotion().samples(evenStamps(0, 5 * kMillisecond, 50));
  const ImuBias bias{{0.1, 0.2, -0.1}, {0.3, -0.4, 0.5}};
  const Preintegration direct = integrate(samples, bias);
  const Preintegration moved = integrate(samples).reintegrated(bias);
  EXPECT_EQ(direct.deltas().dR, moved.deltas().dR);
  EXPECT_EQ(direct.deltas().dp, moved.deltas().dp);
  EXPECT_EQ(direct.covariance(), moved.covariance());
  EXPECT_EQ(direct.dp_dbg(), moved.dp_dbg());
  EXPECT_EQ(moved.bias().accel, bias.accel);
}

TEST(Preintegration, ComposesOverSplitIntervals) {
  const ImuBias bias{{0.02, -0.03, 0.01}, {0.1, 0.05, -0.2}};
  const std::vector<ImuSample> all =
      AnalyticMotion().samples(unevenStamps(0, 5 * kMillisecond, 60, 5));
  const Preintegration whole = integrate(all, bias);
  const Preintegration a = integrate({all.begin(), all.begin() + 24}, bias);
  const Preintegration b = integrate({all.begin() + 23, all.end()}, bias);
  const Matrix3d& dR = a.deltas().dR;
  const double dt = b.dt();
  // Equal by construction: what remains is rounding.
  EXPECT_TRUE(whole.deltas().dR.isApprox(dR * b.deltas().dR, 1e-13));
  EXPECT_TRUE(whole.deltas().dv.isApprox(a.deltas().dv + dR * b.deltas().dv, 1e-13));
  EXPECT_TRUE(
      whole.deltas().dp.isApprox(a.deltas().dp + a.deltas().dv * dt + dR * b.deltas().dp, 1e-13));

  // The errors compose linearly, x = F x_a + G x_b, and so do the covariances.
  using namespace state_index;
  Eigen::Matrix<double, 15, 15> F = Eigen::Matrix<double, 15, 15>::Identity(), G = F;
  F.block<3, 3>(kRotation, kRotation) = b.deltas().dR.transpose();
  F.block<3, 3>(kRotation, kGyroBias) = b.dR_dbg();
  F.block<3, 3>(kPosition, kRotation) = -dR * hat(b.deltas().dp);
  F.block<3, 3>(kPosition, kVelocity) = dt * Matrix3d::Identity();
  F.block<3, 3>(kPosition, kGyroBias) = dR * b.dp_dbg();
  F.block<3, 3>(kPosition, kAccelBias) = dR * b.dp_dba();
  F.block<3, 3>(kVelocity, kRotation) = -dR * hat(b.deltas().dv);
  F.block<3, 3>(kVelocity, kGyroBias) = dR * b.dv_dbg();
  F.block<3, 3>(kVelocity, kAccelBias) = dR * b.dv_dba();
  G.block<3, 3>(kPosition, kPosition) = dR;
  G.block<3, 3>(kVelocity, kVelocity) = dR;
  const Eigen::Matrix<double, 15, 15> composed =
      F * a.covariance() * F.transpose() + G * b.covariance() * G.transpose();
  EXPECT_LT((composed - whole.covariance()).norm(), 1e-12 * whole.covariance().norm());
}

}  // namespace
}  // namespace etalon
