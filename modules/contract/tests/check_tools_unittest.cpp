#include "check_tools.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "spoilt.h"

namespace etalon::contract {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Verdict = ContractCheck::Verdict;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/** The truth of a window as an initializer would give it. */
Initialization truthOf(const SyntheticWindow& window) {
  Initialization result;
  result.states = window.truth;
  result.bias = window.bias;
  return result;
}

Trial biasedTrial(Motion motion) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  return Trial(options);
}

TEST(Bounds, AreExceededByMoreAndByWhatIsNoNumber) {
  EXPECT_FALSE((Bounded{"RRE", "deg", 1.0, 1.0}.exceeded()));
  EXPECT_TRUE((Bounded{"RRE", "deg", 1.1, 1.0}.exceeded()));
  EXPECT_TRUE((Bounded{"RRE", "deg", kNaN, 1.0}.exceeded()));
  EXPECT_FALSE(anyExceeded({{"a", "m", 0.5, 1.0}, {"b", "m", 2.0, 3.0}}));
  EXPECT_TRUE(anyExceeded({{"a", "m", 0.5, 1.0}, {"b", "m", 3.5, 3.0}}));
}

TEST(Bounds, TheWorstShareIsThatOfTheLargestErrorForItsBound) {
  EXPECT_EQ(worstShare({}), 0.0);
  EXPECT_DOUBLE_EQ(worstShare({{"a", "m", 0.5, 1.0}, {"b", "m", 2.0, 3.0}}), 2.0 / 3.0);
  EXPECT_EQ(worstShare({{"a", "m", kNaN, 1.0}, {"b", "m", 2.0, 3.0}}), kInfinity);
  EXPECT_EQ(worstShare({{"a", "m", kInfinity, 1.0}}), kInfinity);
}

TEST(Bounds, AreNamedOnlyWhereTheyAreExceeded) {
  EXPECT_EQ(describe({{"RRE", "deg", 1e-9, 1e-3}, {"velocity", "m/s", 0.02, 0.01}}),
            "RRE 1e-09 deg, velocity 0.02 m/s (at most 0.01 is allowed)");
}

TEST(Complaints, TheWorstComesFirstAndTheOthersAreCounted) {
  Complaints complaints;
  EXPECT_TRUE(complaints.empty());
  complaints.add("gentle", "b_g 0.2", 2.0);
  EXPECT_EQ(complaints.verdict().detail, "gentle: b_g 0.2");
  complaints.add("circle", "b_g 0.9", 9.0);
  EXPECT_EQ(complaints.verdict().detail, "circle: b_g 0.9; 1 more window failed");
  complaints.add("standstill", "throws");  // has no size, and comes first
  complaints.add("aggressive", "b_g 0.9", 9.0);
  const ContractCheck check = complaints.verdict();
  EXPECT_EQ(check.verdict, Verdict::kFailed);
  EXPECT_EQ(check.detail, "standstill: throws; 3 more windows failed");
  // Failures of equal size keep their order.
  EXPECT_THAT(check.failures, ElementsAre("standstill: throws", "circle: b_g 0.9",
                                          "aggressive: b_g 0.9", "gentle: b_g 0.2"));
}

TEST(Ask, TellsARefusalOfTheHostFromAWordThatThePluginBroke) {
  const Trial trial = biasedTrial(Motion::kGentle);
  const auto brokenBy = [](const testing::Change& change, const InitializationProblem& problem) {
    return ask(testing::Spoilt(change), problem).broken;
  };
  EXPECT_EQ(brokenBy([](const auto&, auto*) {}, trial.problem()), "");
  const testing::Change refuses = [](const auto&, InitializationResult* result) {
    *result = refuse(RefusalStatus::kTooLittleMotion, "dull");
  };
  EXPECT_EQ(brokenBy(refuses, trial.problem()), "");
  const testing::Change throws = [](const auto&, auto*) { throw 7; };
  EXPECT_EQ(brokenBy(throws, trial.problem()), "throws what is no std::exception");
  // The host refuses a window without samples before it calls the plugin.
  Trial blind = biasedTrial(Motion::kGentle);
  blind.window.imu = ImuBuffer();
  EXPECT_EQ(brokenBy(throws, blind.problem()), "");
}

TEST(HintAtCause, IsSilentAboutTheTruthAndAboutUnclearErrors) {
  for (const Motion motion : testing::kAllMotions) {
    const Trial trial = biasedTrial(motion);
    EXPECT_EQ(hintAtCause(truthOf(trial.window), trial.window), "") << toString(motion);
  }
  const Trial trial = biasedTrial(Motion::kCircle);
  Initialization noisy = truthOf(trial.window);
  noisy.bias.accel += Eigen::Vector3d(0.3, 0.2, 0.1);
  for (StampedState& s : noisy.states) s.v_WB += Eigen::Vector3d(0.5, -0.4, 0.1);
  EXPECT_EQ(hintAtCause(noisy, trial.window), "");
}

TEST(HintAtCause, KnowsTheUsualMistakes) {
  const Trial trial = biasedTrial(Motion::kCircle);
  const auto hint = [&](const auto& mistake) {
    Initialization result = truthOf(trial.window);
    mistake(&result);
    return hintAtCause(result, trial.window);
  };
  EXPECT_THAT(hint([](Initialization* r) { r->bias.accel *= -1.0; }),
              HasSubstr("the sign of b_a?"));
  EXPECT_THAT(hint([](Initialization* r) { r->bias.gyro *= -1.0; }), HasSubstr("the sign of b_g?"));
  EXPECT_THAT(hint([](Initialization* r) {
                for (StampedState& s : r->states) s.v_WB = s.T_WB.R.transpose() * s.v_WB;
              }),
              HasSubstr("velocity expressed in the body frame?"));
  EXPECT_THAT(hint([](Initialization* r) {
                const SE3 flip(expSO3({M_PI, 0, 0}), Eigen::Vector3d::Zero());
                for (StampedState& s : r->states) s.T_WB = flip * s.T_WB;
              }),
              HasSubstr("does gravity point up?"));
}

}  // namespace
}  // namespace etalon::contract
