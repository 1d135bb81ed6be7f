#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "spoilt.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using testing::check;
using ::testing::HasSubstr;
using testing::ofSuccess;
using testing::Spoilt;
using Verdict = ContractCheck::Verdict;

/** The truth of a drawn window with an error of known covariance on it: what the Monte Carlo wants.
 * The scale is that of the covariance that is given against the one that is true. */
class Drawn : public Initializer {
  DEFINE_MRPT_OBJECT(Drawn, etalon)

 public:
  explicit Drawn(double scale = 1.0) : scale_(scale) {}
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }
  bool singular_ = false, lopsided_ = false, unknown_ = false;

 protected:
  static constexpr double kSigmaTilt = 0.24, kSigmaVelocity = 0.81;  // rad, m/s

  InitializationResult solve(const InitializationProblem& problem) const override {
    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k)
      result.states.push_back({problem.keyframe(k).t, SE3(), Eigen::Vector3d::Zero()});
    // Knows nothing of the motion: b_g and b_a are the prior's, and so are their covariances.
    // Attitude and velocity are as large as those of the windows are.
    result.bias = problem.priors().mean;
    Eigen::VectorXd variances(11);
    variances.segment<2>(6).setConstant(std::pow(kSigmaTilt, 2));
    variances.segment<3>(8).setConstant(std::pow(kSigmaVelocity, 2));
    if (unknown_) variances.tail<5>().setConstant(1e12);
    variances.head<3>().setConstant(std::pow(problem.priors().sigma_gyro_rps, 2));
    variances.segment<3>(3).setConstant(std::pow(problem.priors().sigma_accel_mps2, 2));
    result.covariance = scale_ * variances.asDiagonal().toDenseMatrix();
    if (singular_) result.covariance.bottomRightCorner<3, 3>().setZero();
    if (lopsided_) result.covariance(0, 1) = 0.5 * result.covariance(0, 0);
    return result;
  }

 private:
  double scale_;
};

IMPLEMENTS_MRPT_OBJECT(Drawn, etalon::Initializer, etalon)

TEST(Contract, JudgesCovariances) {
  const Spoilt without(ofSuccess([](auto* r) { r->covariance.resize(0, 0); }));
  for (const char* name : {"covariance.positive_definite", "covariance.consistent"}) {
    const ContractCheck none = check(name, without);
    EXPECT_EQ(none.verdict, Verdict::kNotApplicable);
    EXPECT_THAT(none.detail, HasSubstr("gives none"));
  }
  // One that is ten times too good in velocity alone.
  const Spoilt sure(ofSuccess([](auto* r) {
    r->covariance.middleRows(8, 3) *= 0.3;
    r->covariance.middleCols(8, 3) *= 0.3;
  }));
  const ContractCheck optimistic = check("covariance.consistent", sure);
  EXPECT_EQ(optimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(optimistic.detail, HasSubstr("velocity: too optimistic"));

  Drawn honest(1.0), lopsided(1.0), singular(1.0);
  lopsided.lopsided_ = singular.singular_ = true;
  EXPECT_EQ(check("covariance.positive_definite", honest).verdict, Verdict::kPassed);
  EXPECT_THAT(check("covariance.positive_definite", lopsided).detail, HasSubstr("not symmetric"));
  const ContractCheck not_definite = check("covariance.positive_definite", singular);
  EXPECT_EQ(not_definite.verdict, Verdict::kFailed);
  EXPECT_THAT(not_definite.detail, HasSubstr("not positive definite"));
}

TEST(Contract, ComparesErrorsWithTheCovarianceByMonteCarlo) {
  ContractOptions options;
  options.monte_carlo_windows = 60;
  const ContractCheck honest = check("covariance.consistent", Drawn(1.0), options);
  EXPECT_EQ(honest.verdict, Verdict::kPassed) << honest.detail;
  EXPECT_NEAR(honest.value, 1.0, 0.2);
  const ContractCheck pessimistic = check("covariance.consistent", Drawn(3.0), options);
  EXPECT_EQ(pessimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(pessimistic.detail, HasSubstr("all: too pessimistic"));
  const ContractCheck optimistic = check("covariance.consistent", Drawn(1.0 / 3.0), options);
  EXPECT_EQ(optimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(optimistic.detail, HasSubstr("all: too optimistic"));
  // Gravity and velocity as good as unknown: only six of eleven degrees of freedom contribute. 11/6
  // too much in these and nothing in the others cancel in the sum, but no block is right.
  Drawn unknown(6.0 / 11.0);
  unknown.unknown_ = true;
  const ContractCheck cancelled = check("covariance.consistent", unknown, options);
  EXPECT_EQ(cancelled.verdict, Verdict::kFailed);
  EXPECT_NEAR(cancelled.value, 1.0, 0.2);
  EXPECT_THAT(cancelled.detail,
              AllOf(HasSubstr("b_g: too optimistic"), HasSubstr("velocity: too pessimistic")));
  options.allowed_nees_factor = 4.0;
  EXPECT_EQ(check("covariance.consistent", Drawn(1.0 / 3.0), options).verdict, Verdict::kPassed);
  // Where a part is singular, the other blocks alone.
  Drawn singular(1.0);
  singular.singular_ = true;
  EXPECT_THAT(check("covariance.consistent", singular, options).detail,
              HasSubstr("velocity singular"));
}

}  // namespace
}  // namespace etalon
