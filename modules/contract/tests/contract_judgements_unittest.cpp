// The checks that judge answers one by one, and what the suite makes of verdicts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "truth_teller.h"

namespace etalon {
namespace {

using testing::checkHere;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Motion;
using testing::ofSuccess;
using testing::onlyFor;
using testing::refusing;
using testing::TruthTeller;
using Verdict = ContractCheck::Verdict;

std::vector<std::string> namesOf(const ContractReport& report) {
  std::vector<std::string> names;
  for (const ContractCheck& check : report.checks) names.push_back(check.name);
  return names;
}

ContractReport reportOf(const Initializer& initializer, const std::vector<std::string>& only,
                        bool isolated = false) {
  ContractOptions options;
  options.only = only;
  options.isolated = isolated;
  return checkContract(initializer, options);
}

TEST(ContractSuite, RunsWhatIsNamedInItsOwnOrder) {
  const TruthTeller truth;
  EXPECT_THAT(namesOf(reportOf(truth, {"exact.circle", "parameters"})),
              ElementsAre("parameters", "exact.circle"));
  // All checks whose names begin so, and their summary.
  const ContractReport exact = reportOf(truth, {"exact."});
  EXPECT_THAT(namesOf(exact),
              ElementsAre("exact.gentle", "exact.aggressive", "exact.circle", "exact.pure_rotation",
                          "exact.constant_velocity", "exact.standstill", "exact.somewhere"));
  EXPECT_EQ(exact.checks.back().detail, "exact on 6 of 6 motions, 0 refused");
  EXPECT_EQ(exact.checks.back().value, 6.0);
  EXPECT_TRUE(exact.ok());
  EXPECT_EQ(exact.stopped, "");
  EXPECT_EQ(exact.milliseconds_per_call, 0.0);  // was not asked for
  EXPECT_THROW(reportOf(truth, {"exact"}), ConfigError);
  EXPECT_THROW(reportOf(truth, {""}), ConfigError);
}

TEST(ContractSuite, OneMotionIsEnoughAndNoneIsNot) {
  const TruthTeller picky([](const auto& problem, InitializationResult* result) {
    if (testing::motionOf(problem) != Motion::kCircle) refusing("not round")(problem, result);
  });
  const ContractReport once = reportOf(picky, {"exact."});
  EXPECT_TRUE(once.ok());
  EXPECT_EQ(once.count(Verdict::kRefused), 5);
  EXPECT_EQ(once.count(Verdict::kPassed), 2);
  EXPECT_EQ(once.checks.back().detail, "exact on 1 of 6 motions, 5 refused");
  const ContractReport never = reportOf(TruthTeller(refusing("no")), {"exact."});
  EXPECT_FALSE(never.ok());
  EXPECT_EQ(never.count(Verdict::kFailed), 1);
  EXPECT_EQ(never.checks.back().detail, "exact on 0 of 6 motions, 6 refused");
}

TEST(ContractSuite, AProcessOfItsOwnChangesNoVerdict) {
  // Several complaints, with blanks, digits and line ends in them, and numbers that are none.
  const TruthTeller wrong(ofSuccess([](auto* r) {
    r->bias.gyro.x() += 0.5;
    if (r->states[1].v_WB.norm() > 2.0) throw Error("12 3\n 4 lines");
  }));
  for (const char* name : {"response.gyro_bias", "parameters", "covariance.positive_definite",
                           "covariance.consistent"}) {
    const ContractCheck here = reportOf(wrong, {name}).checks.front();
    const ContractCheck there = reportOf(wrong, {name}, true).checks.front();
    EXPECT_EQ(there.name, name);
    EXPECT_EQ(there.verdict, here.verdict);
    EXPECT_EQ(there.detail, here.detail);
    EXPECT_EQ(there.value, here.value);
    EXPECT_EQ(there.failures, here.failures);
    EXPECT_EQ(there.by_motion, here.by_motion);
  }
  EXPECT_GT(reportOf(wrong, {"response.gyro_bias"}).checks.front().failures.size(), 6U);
}

TEST(ContractSuite, VerdictsHaveTheirWords) {
  EXPECT_STREQ(toString(Verdict::kPassed), "passed");
  EXPECT_STREQ(toString(Verdict::kRefused), "refused");
  EXPECT_STREQ(toString(Verdict::kFailed), "failed");
  EXPECT_STREQ(toString(Verdict::kNotApplicable), "not_applicable");
  for (const ContractCheckDescription& check : contractChecks()) {
    EXPECT_NE(check.name, "");
    EXPECT_EQ(check.description.back(), '.') << check.name;
  }
}

TEST(ContractParameters, TwoObjectsDeclareTheSame) {
  static int number = 7, made = 0;
  TruthTeller changing;
  changing.declare_ = [](ParameterSet& parameters) {
    parameters.add("key_" + std::to_string(made++), &number, {0, 9}, "A number.");
  };
  EXPECT_EQ(checkHere("parameters", changing).detail, "two objects declare different parameters");
  TruthTeller two;
  two.declare_ = [](ParameterSet& parameters) {
    parameters.add("a", &number, {0, 9}, "A number.");
    parameters.add("b", &number, {0, 9}, "The same number.");
  };
  const ContractCheck check = checkHere("parameters", two);
  EXPECT_EQ(check.verdict, Verdict::kPassed);
  EXPECT_EQ(check.detail, "2 parameters, documented; its INI section reads back the same");
  EXPECT_EQ(check.value, 2.0);
}

TEST(ContractNeeds, AreNeitherHiddenNorMadeUp) {
  EXPECT_EQ(checkHere("needs", TruthTeller()).detail, "uses tracks and IMU only and says so");
  TruthTeller boasts;
  boasts.says_needs_ = true;
  EXPECT_THAT(checkHere("needs", boasts).detail, HasSubstr("it uses stereo odometry, but it does"));
  // Used in one motion alone is used.
  const auto uses = onlyFor(
      Motion::kCircle, [](const auto& problem, auto*) { EXPECT_TRUE(problem.visualSolution()); });
  TruthTeller hides(uses);
  EXPECT_EQ(checkHere("needs", hides).verdict, Verdict::kFailed);
  hides.says_needs_ = true;
  EXPECT_EQ(checkHere("needs", hides).detail, "uses stereo odometry and says so");
}

TEST(ContractTime, IsTakenWhereAnAnswerIsGiven) {
  int calls = 0;
  ContractOptions options;
  options.timed_calls = 4;
  const TruthTeller counted(onlyFor(Motion::kAggressive, [&](const auto&, auto*) { ++calls; }));
  const ContractCheck first = checkHere("time", counted, options);
  EXPECT_THAT(first.detail, HasSubstr("ms a call (median of 4, gentle)"));
  EXPECT_EQ(calls, 0);
  const TruthTeller later([](const auto& problem, InitializationResult* result) {
    if (testing::motionOf(problem) == Motion::kGentle) refusing("too gentle")(problem, result);
  });
  options.timed_calls = 0;  // one at least
  EXPECT_THAT(checkHere("time", later, options).detail, HasSubstr("(median of 1, aggressive)"));
  const ContractCheck never = checkHere("time", TruthTeller(refusing("no")), options);
  EXPECT_EQ(never.verdict, Verdict::kRefused);
  EXPECT_EQ(never.value, 0.0);
}

TEST(ContractExact, LandmarksAreLookedUpByTheirIds) {
  const auto withLandmark = [](LandmarkId id) {
    return checkHere("exact.gentle",
                     TruthTeller(ofSuccess([id](auto* r) { r->landmarks[id].setZero(); })));
  };
  EXPECT_EQ(withLandmark(-1).verdict, Verdict::kFailed);
  EXPECT_THAT(withLandmark(1'000'000).detail, HasSubstr("landmarks inf m (at most 0.001"));
}

TEST(ContractResponses, ABiasThatIsFoundInPartIsJudgedByItsBound) {
  // TruthTeller answers zero: b_a may stay at its prior, b_g may not.
  const ContractCheck none = checkHere("response.accel_bias", TruthTeller());
  EXPECT_EQ(none.verdict, Verdict::kPassed) << none.detail;
  EXPECT_EQ(none.value, 0.0);
  EXPECT_EQ(checkHere("response.gyro_bias", TruthTeller()).verdict, Verdict::kFailed);
  const auto saying = [](const Eigen::Vector3d& b_a) {
    return checkHere("response.accel_bias",
                     TruthTeller(ofSuccess([b_a](auto* r) { r->bias.accel = b_a; })));
  };
  // The check tries two biases; this answer has the wrong sign for one of them.
  EXPECT_THAT(saying({0.05, -0.04, 0.06}).detail, HasSubstr("b_a against its direction"));
  EXPECT_EQ(saying({1e-3, -8e-4, 1.2e-3}).verdict, Verdict::kPassed);
}

TEST(ContractResponses, APriorMeanThatIsIgnoredIsTold) {
  const ContractCheck ignored = checkHere("response.prior_mean", TruthTeller());
  EXPECT_EQ(ignored.verdict, Verdict::kFailed);  // b_g is not found
  const auto saying = [](bool accel) {
    return checkHere("response.prior_mean",
                     TruthTeller([accel](const auto& problem, InitializationResult* result) {
                       (*result)->bias.gyro = problem.priors().mean.gyro;
                       if (accel) (*result)->bias.accel = problem.priors().mean.accel;
                     }));
  };
  EXPECT_EQ(saying(true).verdict, Verdict::kPassed);
  EXPECT_EQ(saying(true).value, 6.0);
  EXPECT_THAT(saying(true).detail, HasSubstr("6 exact; exact with biases that the priors know"));
  EXPECT_EQ(saying(false).verdict, Verdict::kPassed);
  EXPECT_THAT(saying(false).detail, HasSubstr("does not use the prior mean of b_a"));
}

TEST(ContractStatus, WhatTheHostRefusesNoAnswerCanSpoil) {
  // NaN, gaps and windows of one keyframe never reach the plugin.
  for (const char* name : {"status.not_finite", "status.empty_imu"}) {
    const ContractCheck check = checkHere(name, TruthTeller());
    EXPECT_EQ(check.verdict, Verdict::kPassed) << check.detail;
    EXPECT_GE(check.value, 4.0);
  }
}

TEST(ContractStatus, ASuccessIsMeasuredAgainstTheTruth) {
  const auto few = [](double mps) {
    return checkHere("status.few_tracks",
                     TruthTeller([mps](const auto& problem, InitializationResult* result) {
                       if (problem.frames().front().observations.size() < 12)
                         return refusing("few")(problem, result);
                       for (StampedState& s : (*result)->states)
                         s.v_WB += s.T_WB.R * Eigen::Vector3d(mps, 0.0, 0.0);
                     }));
  };
  // What the evaluation calls a success: 0.1 m/s.
  EXPECT_EQ(few(0.09).verdict, Verdict::kPassed) << few(0.09).detail;
  EXPECT_EQ(few(0.09).value, 8.0);  // refused: four of five, twice
  EXPECT_THAT(few(0.09).detail, HasSubstr("8 refused, 2 solved"));
  EXPECT_THAT(few(0.11).detail, HasSubstr("is called a success with gravity off by 0.00 deg and "
                                          "velocity by 0.110 m/s (2 deg and 0.1 m/s are allowed)"));
}

TEST(ContractCovariance, OneThatIsGivenTooSeldomIsNoCovariance) {
  ContractOptions options;
  options.monte_carlo_windows = 4;
  int calls = 0;
  const TruthTeller seldom(ofSuccess([&](auto* r) {
    if (calls++ > 2) r->covariance.resize(0, 0);  // after the motions were chosen, once
  }));
  const ContractCheck check = checkHere("covariance.consistent", seldom, options);
  EXPECT_EQ(check.verdict, Verdict::kFailed);
  EXPECT_THAT(check.detail, HasSubstr("gives a covariance for only 1 of 4 windows"));
}

TEST(ContractCovariance, IsDescribedByMotion) {
  ContractOptions options;
  options.monte_carlo_windows = 6;
  options.monte_carlo_motions = {Motion::kCircle, Motion::kStandstill, Motion::kGentle};
  const TruthTeller truth([](const auto& problem, InitializationResult* result) {
    if (testing::motionOf(problem) == Motion::kStandstill) refusing("at rest")(problem, result);
  });
  const ContractCheck check = checkHere("covariance.consistent", truth, options);
  EXPECT_THAT(check.detail, HasSubstr("4 windows, circle and standstill and gentle: "));
  EXPECT_THAT(check.by_motion, ElementsAre(HasSubstr("2 windows, circle: average NEES"),
                                           "0 windows, standstill: no covariance",
                                           HasSubstr("2 windows, gentle: average NEES")));
  // One motion has nothing to be split into.
  options.monte_carlo_motions = {Motion::kCircle};
  EXPECT_TRUE(checkHere("covariance.consistent", truth, options).by_motion.empty());
}

}  // namespace
}  // namespace etalon
