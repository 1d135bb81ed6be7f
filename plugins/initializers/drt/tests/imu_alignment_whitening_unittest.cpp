#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "etalon/optimization/residuals/preintegration_residual.h"
#include "etalon/testing/consistency.h"
#include "etalon/testing/noisy_window.h"
#include "imu_alignment.h"

namespace etalon::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using plugins::ImuAlignment;
using plugins::LinearState;

constexpr double kPriorSigma = 0.05;

/** Half the sum of squares of the preintegration residual's position and velocity rows by their
 * covariance, and of the prior. */
double inertialCost(const NoisyWindow& w, const LinearState& x, const Vector3d& prior_mean) {
  double cost = 0.5 * (x.b_a - prior_mean).squaredNorm() / (kPriorSigma * kPriorSigma);
  for (size_t k = 0; k < w.preintegrations.size(); ++k) {
    const Preintegration& p = w.preintegrations[k];
    const Eigen::Matrix<double, 6, 1> r =
        preintegrationResidual(p, SE3(w.T_VB[k].R, x.p[k]), x.v[k],
                               SE3(w.T_VB[k + 1].R, x.p[k + 1]), x.v[k + 1], {p.bias().gyro, x.b_a},
                               x.g_V)
            .tail<6>();
    const Eigen::Matrix<double, 6, 6> C = p.covariance9().bottomRightCorner<6, 6>();
    cost += 0.5 * r.dot(C.fullPivLu().solve(r));
  }
  return cost;
}

std::vector<Eigen::Matrix3d> rotationsOf(const std::vector<SE3>& T_VB) {
  std::vector<Eigen::Matrix3d> R;
  for (const SE3& T : T_VB) R.push_back(T.R);
  return R;
}

TEST(DrtImuAlignment, GradientAndHessianAreThoseOfThePreintegrationResidual) {
  const NoisyWindow w(imuOnly(0));
  const std::vector<Eigen::Matrix3d> R_VB = rotationsOf(w.T_VB);
  const Vector3d prior_mean(0.05, 0.02, -0.03);
  const ImuAlignment imu(R_VB, w.preintegrations, 9.81, prior_mean, kPriorSigma);
  LinearState x = imu.start();  // wrong velocities: residuals far from zero
  x.b_a += Vector3d(0.1, -0.2, 0.1);
  const Index n = imu.size();
  MatrixXd H = MatrixXd::Zero(n, n);
  VectorXd gradient = VectorXd::Zero(n);
  imu.addTo(x, &H, &gradient);
  // Units differ by orders of magnitude, so each step is a part of its own sigma.
  const VectorXd step = H.diagonal().cwiseSqrt().cwiseInverse();
  VectorXd numerical(n);
  for (Index i = 0; i < n; ++i) {
    const auto at = [&](double h) {
      return inertialCost(w, imu.moved(x, h * step[i] * VectorXd::Unit(n, i)), prior_mean);
    };
    numerical[i] = (at(1.0) - at(-1.0)) / (2.0 * step[i]);
  }
  const VectorXd scaled = gradient.cwiseProduct(step);
  EXPECT_GT(scaled.norm(), 10.0);
  EXPECT_LT((scaled - numerical.cwiseProduct(step)).norm(), 1e-5 * scaled.norm());
  // All unknowns but gravity, which is curved, are linear: the Hessian is the gradient's change.
  for (Index i = 0; i < n; ++i) {
    if (i == n - 5 || i == n - 4) continue;
    MatrixXd ignored = MatrixXd::Zero(n, n);
    VectorXd other = VectorXd::Zero(n);
    imu.addTo(imu.moved(x, step[i] * VectorXd::Unit(n, i)), &ignored, &other);
    EXPECT_LT(((other - gradient) / step[i] - H.col(i)).cwiseProduct(step).norm(),
              1e-6 * H.col(i).cwiseProduct(step).norm())
        << "column " << i;
  }
}

TEST(DrtImuAlignment, CostsWhatItsFreedomSays) {
  ChiSquare chi2;
  for (int run = 0; run < 60; ++run) {
    const NoisyWindow w(imuOnly(run));
    const std::vector<Eigen::Matrix3d> R_VB = rotationsOf(w.T_VB);
    const ImuAlignment imu(R_VB, w.preintegrations, 9.81, w.bias.accel, 0.0);
    LinearState x = imu.start();
    for (size_t k = 0; k < w.T_VB.size(); ++k) x.p[k] = w.T_VB[k].t;
    // Positions are known: the rows determine velocities and gravity.
    const Index n = imu.size(), positions = 3 * w.T_VB.size();
    for (int pass = 0; pass < 5; ++pass) {
      MatrixXd H = MatrixXd::Zero(n, n);
      VectorXd gradient = VectorXd::Zero(n), step = VectorXd::Zero(n);
      imu.addTo(x, &H, &gradient);
      const Index size = n - positions;
      step.tail(size) = H.bottomRightCorner(size, size).ldlt().solve(-gradient.tail(size));
      x = imu.moved(x, step);
    }
    const double keyframes = static_cast<double>(w.T_VB.size());
    chi2.add(2.0 * inertialCost(w, x, x.b_a), 6.0 * (keyframes - 1.0) - 3.0 * keyframes - 2.0);
  }
  expectConsistent(chi2);
}

}  // namespace
}  // namespace etalon::testing
