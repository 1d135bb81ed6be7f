#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "drt/imu_alignment.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/optimization/residuals/preintegration_residual.h"
#include "joint_closed_form/closed_form_motion.h"
#include "noisy_window.h"
#include "statistics.h"

namespace etalon::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using plugins::ClosedFormMotion;
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
  // Units differ by orders of magnitude: each step is a part of its own sigma.
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
  // All but gravity, which is curved, is linear: the Hessian is the gradient's change.
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
    const Index n = imu.size(), positions = 3 * static_cast<Index>(w.T_VB.size());
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

/** Errors [rotation, alpha, beta] of the nodes but the first, composed less true. */
VectorXd motionErrors(const NoisyWindow& w, const ClosedFormMotion& motion) {
  constexpr Index kError = ClosedFormMotion::kError;
  VectorXd e(kError * (static_cast<Index>(motion.nodes.size()) - 1));
  for (size_t k = 1; k < motion.nodes.size(); ++k) {
    const ClosedFormMotion::Node& node = motion.nodes[k];
    e.segment<kError>(kError * (static_cast<Index>(k) - 1))
        << logSO3(w.T_VB[k].R.transpose() * node.R_VB),
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
    const ClosedFormMotion motion = plugins::composeMotion(w.preintegrations);
    const VectorXd e = motionErrors(w, motion);
    sample.add(motion.covariance.llt().matrixL().solve(e));
  }
  expectWhite(sample);
}

TEST(ClosedFormMotion, BiasJacobianAgreesWithDifferences) {
  const NoisyWindow w(imuOnly(1));
  const ClosedFormMotion at = plugins::composeMotion(w.preintegrations);
  constexpr double kStep = 1e-5;
  for (int a = 0; a < 6; ++a) {
    VectorXd side[2];
    for (int s = 0; s < 2; ++s) {
      ImuBias bias = w.bias;
      (a < 3 ? bias.gyro : bias.accel)[a % 3] += s ? kStep : -kStep;
      side[s] = motionErrors(w, plugins::composeMotion(w.preintegrate(bias)));
    }
    for (size_t k = 1; k < at.nodes.size(); ++k) {
      const Index i = 9 * (static_cast<Index>(k) - 1);
      const VectorXd numerical = (side[1] - side[0]).segment<9>(i) / (2.0 * kStep);
      // The midpoint's derivative within a step is of second order in the step as well.
      EXPECT_LT((numerical - at.nodes[k].bias.col(a)).norm(), 1e-3 * (1.0 + numerical.norm()));
    }
  }
}

TEST(TrackInformation, PosesErrAsTheInformationSays) {
  ChiSquare errors;
  for (int run = 0; run < 40; ++run) {
    const double sigma_px = run % 2 == 0 ? 0.3 : 0.05;
    SyntheticWindowOptions options = withTracks(run, sigma_px, 100);
    options.motion = Motion::kGentle;
    options.keyframes = 5;
    const NoisyWindow w(options);
    const VisualWindow window = w.visual(sigma_px);
    TrackInformation tracks(window, 1e3);  // so wide that every weight is one
    std::vector<SE3> T_VB = w.T_VB;
    tracks.start(stereoPoints(window, 1e9), T_VB);
    for (int pass = 0; pass < 6; ++pass) {  // Gauss-Newton, as the depths change
      for (int i = 0; i < 3; ++i) tracks.triangulate(T_VB);
      tracks.linearize(T_VB);
      const VectorXd y = tracks.S().ldlt().solve(tracks.s());
      for (size_t k = 1; k < T_VB.size(); ++k) {
        const Index i = 6 * (static_cast<Index>(k) - 1);
        T_VB[k].R = nearestRotation(T_VB[k].R * expSO3(y.segment<3>(i)));
        T_VB[k].t += y.segment<3>(i + 3);
      }
    }
    const VectorXd e = poseErrors(T_VB, w.T_VB);
    errors.add(e.dot(tracks.S() * e), static_cast<double>(e.size()));
  }
  expectConsistent(errors);
}

}  // namespace
}  // namespace etalon::testing
