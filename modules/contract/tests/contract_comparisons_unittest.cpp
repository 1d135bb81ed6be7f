// The checks that ask more than once: for the same, for copies, in another world.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "etalon/core/so3.h"
#include "truth_teller.h"

namespace etalon {
namespace {

using testing::Change;
using testing::checkHere;
using ::testing::HasSubstr;
using testing::Motion;
using testing::ofSuccess;
using testing::onlyFor;
using testing::refusing;
using ::testing::StartsWith;
using testing::TruthTeller;
using Verdict = ContractCheck::Verdict;

TEST(ContractComparisons, TheTruthPassesThem) {
  const ContractCheck same = checkHere("deterministic", TruthTeller());
  EXPECT_EQ(same.verdict, Verdict::kPassed) << same.detail;
  EXPECT_EQ(same.value, 6.0);
  for (const char* name : {"invariant.world", "invariant.time_origin"}) {
    const ContractCheck check = checkHere(name, TruthTeller());
    EXPECT_EQ(check.verdict, Verdict::kPassed) << check.detail;
    EXPECT_THAT(check.detail, StartsWith("6 motions: at most 0 apart"));
  }
}

TEST(ContractComparisons, WhoRefusesEverythingIsTheSameAndRefused) {
  const TruthTeller never(refusing("too dull"));
  const ContractCheck same = checkHere("deterministic", never);
  EXPECT_EQ(same.verdict, Verdict::kPassed);
  EXPECT_EQ(same.value, 0.0);
  EXPECT_THAT(same.detail, HasSubstr("0 answered"));
  const ContractCheck world = checkHere("invariant.world", never);
  EXPECT_EQ(world.verdict, Verdict::kRefused);
  EXPECT_EQ(world.detail, "too_little_motion: too dull");
}

TEST(ContractComparisons, NamesWhatDiffersWhenAskedAgain) {
  // The number of calls changes one part of the answer at a time.
  const std::pair<const char*, std::function<void(Initialization*, double)>> parts[] = {
      {"the rotation of keyframe 3",
       [](auto* r, double d) {
         r->states[3].T_WB.R = r->states[3].T_WB.R * expSO3({d, 0.0, 0.0});
       }},
      {"the position of keyframe 9", [](auto* r, double d) { r->states[9].T_WB.t.z() += d; }},
      {"the velocity of keyframe 0", [](auto* r, double d) { r->states[0].v_WB.y() += d; }},
      {"b_g", [](auto* r, double d) { r->bias.gyro.x() += d; }},
      {"b_a", [](auto* r, double d) { r->bias.accel.x() += d; }},
      {"the landmarks", [](auto* r, double d) { r->landmarks[7].setConstant(d); }},
      {"the number of landmarks",
       [](auto* r, double d) {
         r->landmarks[0].setZero();
         if (d > 0.0) r->landmarks[1].setZero();
       }},
      {"the covariance", [](auto* r, double d) { r->covariance(10, 10) += d; }},
  };
  for (const auto& [what, change] : parts) {
    int calls = 0;
    const ContractCheck check = checkHere(
        "deterministic",
        TruthTeller(ofSuccess([&, change = change](auto* r) { change(r, 1e-9 * (calls++ / 2)); })));
    EXPECT_EQ(check.verdict, Verdict::kFailed);
    EXPECT_EQ(check.detail, std::string("gentle: ") + what + " differs when asked again");
  }
}

TEST(ContractComparisons, ARefusalIsToBeTheSameToTheWord) {
  int calls = 0;
  const ContractCheck reason = checkHere(
      "deterministic", TruthTeller([&](const auto& problem, InitializationResult* result) {
        refusing("call " + std::to_string(calls++ / 2))(problem, result);
      }));
  EXPECT_EQ(reason.detail, "gentle: the reason differs when asked again");
  calls = 0;
  const ContractCheck status =
      checkHere("deterministic", TruthTeller([&](const auto&, InitializationResult* result) {
                  if (calls++ >= 2) *result = refuse(RefusalStatus::kNotConverged, "tired");
                }));
  EXPECT_EQ(status.detail, "gentle: the status differs when asked again");
}

TEST(ContractComparisons, WhatAnotherThreadChangesIsFound) {
  const std::thread::id here = std::this_thread::get_id();
  const ContractCheck check = checkHere("deterministic", TruthTeller(ofSuccess([here](auto* r) {
                                          if (std::this_thread::get_id() != here)
                                            r->bias.gyro.x() += 1e-15;
                                        })));
  EXPECT_EQ(check.verdict, Verdict::kFailed);
  EXPECT_EQ(check.detail, "gentle: b_g differs in another thread");
}

TEST(ContractComparisons, WhatGoesWrongInOneMotionIsFoundThere) {
  int calls = 0;
  const ContractCheck check =
      checkHere("deterministic", TruthTeller(onlyFor(Motion::kCircle, ofSuccess([&](auto* r) {
                                                       r->bias.accel.y() = 1e-12 * calls++;
                                                     }))));
  EXPECT_EQ(check.detail, "circle: b_a differs when asked again");
}

/** The check's verdict on an initializer that changes its answer about the second window of each
 * motion. */
ContractCheck worldCheck(const std::function<void(Initialization*)>& change) {
  int calls = 0;
  return checkHere("invariant.world", TruthTeller(ofSuccess([&](auto* r) {
                     if (calls++ % 2) change(r);
                   })));
}

TEST(ContractComparisons, AnotherWorldMayTurnAboutZAndMoveTheAnswerAndNothingElse) {
  const SE3 T(expSO3({0.0, 0.0, 1.3}), {4.0, 5.0, 6.0});
  const ContractCheck turned = worldCheck([&](Initialization* r) {
    for (StampedState& s : r->states) s.T_WB = T * s.T_WB, s.v_WB = T.R * s.v_WB;
  });
  EXPECT_EQ(turned.verdict, Verdict::kPassed) << turned.detail;
  // 1e-5 is allowed, in rad as in m.
  const ContractCheck little = worldCheck([](auto* r) { r->bias.gyro.x() += 0.9e-5; });
  EXPECT_EQ(little.verdict, Verdict::kPassed);
  EXPECT_NEAR(little.value, 0.9e-5, 1e-12);
  EXPECT_THAT(worldCheck([](auto* r) { r->bias.gyro.x() += 1.1e-5; }).detail,
              HasSubstr("b_g 1.1e-05 rad/s (at most 1e-05 is allowed)"));
  EXPECT_THAT(worldCheck([](auto* r) { r->bias.accel.x() += 2e-5; }).detail,
              HasSubstr("b_a 2e-05 m/s^2 (at most"));
  EXPECT_THAT(worldCheck([](auto* r) { r->states[4].T_WB.t.x() += 2e-5; }).detail,
              HasSubstr("position 2e-05 m (at most"));
  EXPECT_THAT(worldCheck([](auto* r) { r->states[4].v_WB.x() += 2e-5; }).detail,
              HasSubstr("velocity 2e-05 m/s (at most"));
  const SE3 tilt(expSO3({2e-5, 0.0, 0.0}), Eigen::Vector3d::Zero());
  EXPECT_THAT(worldCheck([&](auto* r) {
                for (StampedState& s : r->states) s.T_WB = tilt * s.T_WB, s.v_WB = tilt.R * s.v_WB;
              }).detail,
              HasSubstr("gravity 2e-05 rad (at most"));
  EXPECT_THAT(worldCheck([&](auto* r) {
                StampedState& s = r->states[4];
                s.T_WB.R = s.T_WB.R * tilt.R;
                s.v_WB = s.T_WB.R * (tilt.R * (s.T_WB.R.transpose() * s.v_WB));
              }).detail,
              HasSubstr("rotation 2e-05 rad (at most"));
}

TEST(ContractComparisons, ASuccessHereAndARefusalThereIsNotTheSame) {
  int calls = 0;
  const ContractCheck check = checkHere(
      "invariant.world", TruthTeller([&](const auto& problem, InitializationResult* result) {
        if (calls++ > 0) refusing("too far from home")(problem, result);
      }));
  EXPECT_EQ(check.verdict, Verdict::kFailed);
  EXPECT_THAT(check.detail, HasSubstr("once success, once too_little_motion: too far from home"));
}

TEST(ContractComparisons, ABrokenAnswerIsNotComparedButTold) {
  const ContractCheck check =
      checkHere("invariant.world", TruthTeller(onlyFor(Motion::kStandstill, [](const auto&, auto*) {
                  throw std::runtime_error("no motion, no start");
                })));
  EXPECT_EQ(check.verdict, Verdict::kFailed);
  EXPECT_EQ(check.detail, "standstill: throws: no motion, no start");
}

}  // namespace
}  // namespace etalon
