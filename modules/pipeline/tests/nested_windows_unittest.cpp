#include "etalon/pipeline/nested_windows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kSigma = 1e-3;

/** The truth at keyframes `first` to `last`, in a world turned about its z, with a covariance. */
InitializationAttempt attempt(int first, int last, double yaw) {
  InitializationAttempt attempt;
  Initialization init;
  const SE3 T_WG(expSO3(Vector3d(0, 0, yaw)), Vector3d(yaw, 0, 0));
  for (int k = first; k <= last; ++k) {
    attempt.keyframes.push_back(250'000'000LL * k);
    const SE3 T_GB(expSO3(Vector3d(0.1, -0.2, 0.3) * k), Vector3d(k, 0.5 * k, 0));
    init.states.push_back({attempt.keyframes.back(), T_WG * T_GB, T_WG.R * Vector3d(k, 1, 0)});
  }
  init.covariance = kSigma * kSigma * Eigen::MatrixXd::Identity(11, 11);
  attempt.t = attempt.keyframes.back();
  attempt.init = init;
  attempt.decision = {};
  return attempt;
}

TEST(NestedWindows, AgreeWhateverTheYawOfTheirWorlds) {
  EXPECT_TRUE(agree(attempt(0, 3, 0.0), attempt(0, 4, 1.0), {}));
  EXPECT_TRUE(agree(attempt(0, 3, 0.5), attempt(1, 4, -1.0), {}));  // it slid
}

TEST(NestedWindows, DisagreeWhereOneIsFartherOffThanItsCovarianceSays) {
  AcceptanceOptions options;
  options.noise_margin = 1.0;  // chi-square of 11 degrees of freedom at 0.001: 31.26
  const InitializationAttempt earlier = attempt(0, 3, 0.0);
  InitializationAttempt later = attempt(0, 4, 1.0);
  later.init->bias.gyro.x() = 5.5 * kSigma;
  EXPECT_TRUE(agree(earlier, later, options));
  later.init->bias.gyro.x() = 5.7 * kSigma;
  const Expected<void> verdict = agree(earlier, later, options);
  ASSERT_FALSE(verdict);
  EXPECT_EQ(verdict.error().status, RefusalStatus::kImplausible);
  EXPECT_NEAR(*verdict.error().value, 5.7 * 5.7, 1e-6);
  EXPECT_NEAR(*verdict.error().bound, 31.26, 0.01);
  EXPECT_THAT(verdict.error().reason, HasSubstr("differs from that of the window before"));
  // The velocity counts at the end of the earlier window.
  later = attempt(0, 4, 1.0);
  later.init->states[3].v_WB.z() += 6.0 * kSigma;
  EXPECT_FALSE(agree(earlier, later, options));
  later = attempt(0, 4, 1.0);
  later.init->states[4].v_WB.z() += 6.0 * kSigma;
  EXPECT_TRUE(agree(earlier, later, options));
  // Gravity: the later window is tilted.
  later = attempt(0, 4, 0.0);
  for (StampedState& state : later.init->states)
    state.T_WB = SE3(expSO3(Vector3d(7.0 * kSigma, 0, 0)), Vector3d::Zero()) * state.T_WB;
  EXPECT_FALSE(agree(earlier, later, options));
}

TEST(NestedWindows, TheMarginIsOneOfStandardDeviations) {
  AcceptanceOptions options;
  options.noise_margin = 3.0;  // 9 * 31.26 = 16.77^2
  InitializationAttempt later = attempt(0, 4, 1.0);
  later.init->bias.gyro.x() = 16.7 * kSigma;
  EXPECT_TRUE(agree(attempt(0, 3, 0.0), later, options));
  later.init->bias.gyro.x() = 16.9 * kSigma;
  EXPECT_FALSE(agree(attempt(0, 3, 0.0), later, options));
}

TEST(NestedWindows, WithoutAnythingToCompareThereIsNothingToBelieve) {
  const AcceptanceOptions options;
  const auto status = [&](const InitializationAttempt& earlier) {
    const Expected<void> verdict = agree(earlier, attempt(4, 8, 0.0), options);
    return verdict ? "agreed" : toString(verdict.error().status);
  };
  EXPECT_STREQ(status(attempt(0, 4, 0.0)), "too_few_keyframes");
  EXPECT_STREQ(status(attempt(0, 5, 0.0)), "agreed");
  InitializationAttempt refused = attempt(0, 5, 0.0);
  refused.init = refuse(RefusalStatus::kTooFewTracks, "none");
  EXPECT_STREQ(status(refused), "too_few_keyframes");
  InitializationAttempt unsure = attempt(0, 5, 0.0);
  unsure.init->covariance.resize(0, 0);
  EXPECT_STREQ(status(unsure), "too_few_keyframes");
  // An estimate that has not converged says nothing against the next.
  InitializationAttempt under_way = attempt(0, 5, 0.0);
  under_way.has_vi_ba = true;
  for (const StampedState& state : under_way.init->states)
    under_way.vi_ba.states.push_back({state.T_WB, state.v_WB, {}});
  under_way.vi_ba.covariance = kSigma * kSigma * Eigen::MatrixXd::Identity(60, 60);
  under_way.vi_ba.summary.termination = Termination::kMaxIterations;
  EXPECT_STREQ(status(under_way), "too_few_keyframes");
}

TEST(NestedWindows, ConfirmTakesBackWhatIsNotConfirmed) {
  InitializationAttempt later = attempt(0, 4, 0.0);
  EXPECT_FALSE(confirm(nullptr, {}, &later));  // another window is all that it lacks
  ASSERT_FALSE(later.accepted());
  EXPECT_THAT(later.decision.error().reason, HasSubstr("the next keyframe"));
  const InitializationAttempt earlier = attempt(0, 3, 0.0);
  later = attempt(0, 4, 0.0);
  EXPECT_TRUE(confirm(&earlier, {}, &later));
  EXPECT_TRUE(later.accepted());
  later.init->bias.gyro.x() = 1.0;  // which another window does not mend
  EXPECT_TRUE(confirm(&earlier, {}, &later));
  EXPECT_FALSE(later.accepted());
  // What was refused keeps its reason.
  later.decision = refuse(RefusalStatus::kIllConditioned, "gravity");
  EXPECT_TRUE(confirm(nullptr, {}, &later));
  EXPECT_EQ(later.decision.error().reason, "gravity");
  // Without tests of residuals there is none of this either.
  later = attempt(0, 4, 0.0);
  AcceptanceOptions none;
  none.false_alarm_rate = 0.0;
  EXPECT_TRUE(confirm(nullptr, none, &later));
  EXPECT_TRUE(later.accepted());
}

}  // namespace
}  // namespace etalon
