// The errors of a window against a second implementation by other means: quaternions' eigenvalues,
// complex numbers, cross products.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <complex>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/evaluation/metrics.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadiansPerDegree = M_PI / 180.0;

GroundTruth groundTruthOf(const std::vector<StampedState>& states, const ImuBias& bias) {
  GroundTruth truth;
  truth.has_velocity = truth.has_biases = true;
  for (const StampedState& s : states) truth.states.push_back({s.t, s.T_WB, s.v_WB, bias});
  return truth;
}

const ImuBias kTrueBiases{Vector3d(0.01, 0.02, 0.03), Vector3d(0.1, 0.2, 0.3)};

/** Random keyframes and an estimate near them, for the comparison with a second implementation. */
struct RandomWindow {
  std::vector<StampedState> truth, estimate;
  std::vector<Vector3d> gyro_bias, accel_bias;  ///< true ones, at each keyframe

  explicit RandomWindow(unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    const auto vector = [&](double s) {
      return Vector3d(s * normal(generator), s * normal(generator), s * normal(generator));
    };
    for (int k = 0; k < 10; ++k) {
      StampedState t, e;
      t.t = e.t = 250'000'000LL * k;
      t.T_WB = SE3(expSO3(vector(1.0)), vector(1.0));
      t.v_WB = vector(1.0);
      e.T_WB = SE3(t.T_WB.R * expSO3(vector(0.01)), t.T_WB.t + vector(0.01));
      e.v_WB = t.v_WB + vector(0.05);
      truth.push_back(t);
      estimate.push_back(e);
      gyro_bias.push_back(Vector3d(0.01, 0.02, 0.03) + vector(0.01));
      accel_bias.push_back(Vector3d(-0.1, 0.2, 0.1) + vector(0.1));
    }
  }
};

/** Least sum of squares after a rigid motion, without finding the motion: |a|^2 + |b|^2 - 2 lambda,
 * Horn 1987. */
double ateByQuaternionEigenvalue(const std::vector<StampedState>& a,
                                 const std::vector<StampedState>& b) {
  const auto n = static_cast<double>(a.size());
  Vector3d mean_a = Vector3d::Zero(), mean_b = Vector3d::Zero();
  for (size_t k = 0; k < a.size(); ++k) {
    mean_a += a[k].T_WB.t / n;
    mean_b += b[k].T_WB.t / n;
  }
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  double squares = 0.0;
  for (size_t k = 0; k < a.size(); ++k) {
    const Vector3d p = a[k].T_WB.t - mean_a, q = b[k].T_WB.t - mean_b, c = p.cross(q);
    squares += p.squaredNorm() + q.squaredNorm();
    N(0, 0) += p.dot(q);
    N.block<1, 3>(0, 1) += c.transpose();
    N.block<3, 1>(1, 0) += c;
    N.block<3, 3>(1, 1) += p * q.transpose() + q * p.transpose() - p.dot(q) * Matrix3d::Identity();
  }
  const double lambda = symmetricEigenvalues(N).maxCoeff();
  return std::sqrt(std::max(0.0, squares - 2.0 * lambda) / n);
}

/** Least RMS distance over all turns about z, by complex numbers: with centred x + i y as numbers,
 * the best turn leaves sum |a|^2 + |b|^2 - 2 |sum a conj(b)|. */
double ateInYawByComplexNumbers(const std::vector<StampedState>& a,
                                const std::vector<StampedState>& b) {
  using Complex = std::complex<double>;
  const auto n = static_cast<double>(a.size());
  Complex mean_a, mean_b, cross;
  double height = 0.0, squares = 0.0;
  for (size_t k = 0; k < a.size(); ++k) {
    mean_a += Complex(a[k].T_WB.t.x(), a[k].T_WB.t.y()) / n;
    mean_b += Complex(b[k].T_WB.t.x(), b[k].T_WB.t.y()) / n;
    height += (a[k].T_WB.t.z() - b[k].T_WB.t.z()) / n;
  }
  for (size_t k = 0; k < a.size(); ++k) {
    const Complex p = Complex(a[k].T_WB.t.x(), a[k].T_WB.t.y()) - mean_a;
    const Complex q = Complex(b[k].T_WB.t.x(), b[k].T_WB.t.y()) - mean_b;
    cross += p * std::conj(q);
    squares +=
        std::norm(p) + std::norm(q) + std::pow(a[k].T_WB.t.z() - b[k].T_WB.t.z() - height, 2);
  }
  return std::sqrt(std::max(0.0, squares - 2.0 * std::abs(cross)) / n);
}

/** Scale of the Sim(3) alignment of b onto a: lambda / |b|^2, lambda as above. */
double scaleByQuaternionEigenvalue(const std::vector<StampedState>& a,
                                   const std::vector<StampedState>& b) {
  Vector3d mean_a = Vector3d::Zero(), mean_b = Vector3d::Zero();
  const auto n = static_cast<double>(a.size());
  for (size_t k = 0; k < a.size(); ++k) {
    mean_a += a[k].T_WB.t / n;
    mean_b += b[k].T_WB.t / n;
  }
  double squares_a = 0.0, squares_b = 0.0;
  for (size_t k = 0; k < a.size(); ++k) {
    squares_a += (a[k].T_WB.t - mean_a).squaredNorm();
    squares_b += (b[k].T_WB.t - mean_b).squaredNorm();
  }
  // n ate^2 = |a|^2 + |b|^2 - 2 lambda.
  const double lambda =
      0.5 * (squares_a + squares_b - n * std::pow(ateByQuaternionEigenvalue(a, b), 2));
  return lambda / squares_b;
}

TEST(WindowMetrics, AgreesWithASecondImplementationOnRandomWindows) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const RandomWindow s(seed);
    const Quaterniond tilt(Eigen::AngleAxisd(0.01 * seed, Vector3d(0.6, 0.8, 0).normalized()));
    const Vector3d g_G = tilt * Vector3d(0, 0, -1);
    GroundTruth ground_truth = groundTruthOf(s.truth, {});
    Vector3d mean_gyro = Vector3d::Zero(), mean_accel = Vector3d::Zero();
    for (size_t k = 0; k < s.truth.size(); ++k) {  // biases that walk
      ground_truth.states[k].bias.gyro = s.gyro_bias[k];
      ground_truth.states[k].bias.accel = s.accel_bias[k];
      mean_gyro += 0.1 * s.gyro_bias[k];
      mean_accel += 0.1 * s.accel_bias[k];
    }
    const WindowErrors e = evaluateWindow(s.estimate, kTrueBiases, ground_truth, g_G);
    double rotation = 0.0, velocity = 0.0;
    for (size_t k = 0; k < s.truth.size(); ++k) {
      const Quaterniond truth(s.truth[k].T_WB.R), estimate(s.estimate[k].T_WB.R);
      velocity += (estimate.conjugate() * s.estimate[k].v_WB - truth.conjugate() * s.truth[k].v_WB)
                      .squaredNorm() /
                  10.0;
      if (k == 0) continue;
      const Quaterniond dt = Quaterniond(s.truth[k - 1].T_WB.R).conjugate() * truth;
      const Quaterniond de = Quaterniond(s.estimate[k - 1].T_WB.R).conjugate() * estimate;
      rotation += std::pow(dt.angularDistance(de) / kRadiansPerDegree, 2) / 9.0;
    }
    EXPECT_NEAR(e.rre_deg, std::sqrt(rotation), 1e-9) << seed;
    EXPECT_NEAR(e.velocity_mps, std::sqrt(velocity), 1e-12) << seed;
    // squares - 2 lambda loses digits: 1e-15 * 30 in the square of 0.01.
    EXPECT_NEAR(e.ate_m, ateByQuaternionEigenvalue(s.truth, s.estimate), 1e-11) << seed;
    EXPECT_NEAR(e.ate_yaw_m, ateInYawByComplexNumbers(s.truth, s.estimate), 1e-11) << seed;
    EXPECT_NEAR(e.scale_error, std::abs(1.0 - scaleByQuaternionEigenvalue(s.truth, s.estimate)),
                1e-12)
        << seed;
    const Vector3d corrected = Quaterniond(s.truth[0].T_WB.R).conjugate() * g_G;
    const Vector3d estimated = -(Quaterniond(s.estimate[0].T_WB.R).conjugate() * Vector3d::UnitZ());
    EXPECT_NEAR(e.gravity_corrected_deg, std::acos(corrected.dot(estimated)) / kRadiansPerDegree,
                1e-9);  // acos of an angle of 0.01 rad and more: 1e-16 / 0.01
    const Vector3d g_true = s.truth[0].T_WB.R.row(2), g_estimated = s.estimate[0].T_WB.R.row(2);
    EXPECT_NEAR(e.gravity_deg, std::asin(g_true.cross(g_estimated).norm()) / kRadiansPerDegree,
                1e-10);
    EXPECT_NEAR(e.gyro_bias_rps, (kTrueBiases.gyro - mean_gyro).norm(), 1e-15) << seed;
    EXPECT_NEAR(e.accel_bias_mps2, (kTrueBiases.accel - mean_accel).norm(), 1e-14) << seed;
  }
}

}  // namespace
}  // namespace etalon
