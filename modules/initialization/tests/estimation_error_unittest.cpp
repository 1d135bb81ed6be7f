#include "etalon/initialization/estimation_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

TEST(EstimationError, TakesYawOutAndTiltAboutTheWorldsAxes) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const Eigen::Vector3d tilt(0.01, -0.02, 0.0), dv(0.1, 0.2, -0.3);
  const Eigen::Matrix3d yaw = expSO3({0.0, 0.0, 2.5});
  Initialization result;
  result.states = window.truth;
  for (StampedState& s : result.states) {
    s.T_WB.R = expSO3(tilt) * yaw * s.T_WB.R;
    s.v_WB = yaw * s.v_WB + dv;
  }
  result.bias.gyro = {1e-3, 2e-3, 3e-3};
  const Eigen::Matrix<double, 11, 1> error = estimationError(result, window);
  Eigen::Matrix<double, 11, 1> expected;
  expected << 1e-3, 2e-3, 3e-3, 0, 0, 0, tilt.head<2>(), dv;
  EXPECT_LT((error - expected).norm(), 1e-12);
}

/** Draws of a better estimate of one window around its truth, and one that is far from it. */
class CovarianceAround : public ::testing::Test {
 protected:
  CovarianceAround() : window_(testing::makeSyntheticWindow({})), normal_(0.0, 1.0), rng_(1) {
    const size_t poses = window_.truth.size() - 1;
    sigmas_.resize(11 + 6 * poses);
    sigmas_ << Eigen::VectorXd::Constant(3, 1e-3), Eigen::VectorXd::Constant(3, 0.1),
        Eigen::VectorXd::Constant(2, 0.01), Eigen::VectorXd::Constant(3, 0.01),
        Eigen::VectorXd::Constant(6 * poses, 1e-3);
  }

  /** The truth with an error in the order of the covariance. */
  Initialization withError(const Eigen::VectorXd& error) const {
    Initialization result;
    result.states = window_.truth;
    const Eigen::Matrix3d tilt = expSO3({error[6], error[7], 0.0});
    const SE3 T_WB0 = result.states[0].T_WB;
    for (size_t k = 0; k < result.states.size(); ++k) {
      SE3 T_B0Bk = T_WB0.inverse() * result.states[k].T_WB;
      if (k > 0) {
        T_B0Bk.R = T_B0Bk.R * expSO3(error.segment<3>(6 * k + 5));
        T_B0Bk.t += error.segment<3>(6 * k + 8);
      }
      result.states[k].T_WB = SE3(tilt * T_WB0.R, T_WB0.t) * T_B0Bk;
      result.states[k].v_WB += error.segment<3>(8);
    }
    result.bias.gyro = window_.bias.gyro + error.head<3>();
    result.bias.accel = window_.bias.accel + error.segment<3>(3);
    return result;
  }
  Initialization drawn() {
    Eigen::VectorXd error(sigmas_.size());
    for (double& e : error) e = normal_(rng_);
    Initialization result = withError(error.cwiseProduct(sigmas_));
    result.covariance = sigmas_.cwiseAbs2().asDiagonal();
    return result;
  }
  double nees(const Initialization& estimate, const Eigen::MatrixXd& covariance) const {
    Eigen::VectorXd error(sigmas_.size());
    error << testing::estimationError(estimate, window_),
        relativePoseErrors(estimate.states, window_.truth);
    return squaredMahalanobis(error, covariance) / static_cast<double>(error.size());
  }

  testing::SyntheticWindow window_;
  std::normal_distribution<double> normal_;
  std::mt19937 rng_;
  Eigen::VectorXd sigmas_;
};

TEST_F(CovarianceAround, IsTrueOfAnEstimateHoweverFarItIs) {
  constexpr int kDraws = 200;
  for (const double far : {3.0, 15.0}) {  // standard deviations: up to 0.15 rad and 0.15 m/s
    const Initialization estimate = withError(far * sigmas_);
    double sum = 0.0;
    for (int i = 0; i < kDraws; ++i)
      sum += nees(estimate, covarianceAround(drawn(), estimate)) / kDraws;
    // Four standard deviations, and what products of tilt and velocity add.
    const double dof = static_cast<double>(kDraws * sigmas_.size());
    EXPECT_NEAR(sum, 1.0, 4.0 * std::sqrt(2.0 / dof) + 0.05) << far;
  }
}

TEST_F(CovarianceAround, IsThatOfTheBetterOneWhereTheTwoAgree) {
  const Initialization better = drawn();
  EXPECT_LT((covarianceAround(better, better) - better.covariance).norm(), 1e-15);
}

TEST_F(CovarianceAround, HasNoPosesWhereTheBetterOneHasNoneAndIsEmptyWithoutACovariance) {
  const Initialization estimate = withError(3.0 * sigmas_);
  Initialization better = drawn();
  const Eigen::MatrixXd whole = covarianceAround(better, estimate);
  better.covariance = better.covariance.topLeftCorner<11, 11>().eval();
  EXPECT_EQ(covarianceAround(better, estimate), (whole.topLeftCorner<11, 11>()));
  better.covariance.resize(0, 0);
  EXPECT_EQ(covarianceAround(better, estimate).size(), 0);
}

}  // namespace
}  // namespace etalon
