// Attempts at a start: what one keeps, finds and checks.

#include "etalon/pipeline/starter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "etalon/pipeline/window_initialization.h"
#include "etalon/testing/synthetic_window.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Starter, AnAcceptedAttemptKeepsItsEstimatesHoweverOldItIs) {
  const testing::SyntheticWindowOptions window_options;
  const testing::SyntheticWindow synthetic = testing::makeSyntheticWindow(window_options);
  const InitializationProblem problem = testing::makeProblem(synthetic, window_options);
  KeyframeWindow window(3, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) window.add(frame, window.isKeyframe(frame.t));
  int asked = 0;
  PipelineInitializers initializers;
  initializers.at_rest_name = "at_rest";
  initializers.at_rest =
      std::make_shared<Scripted>([&](const InitializationProblem&) -> InitializationResult {
        if (asked++ > 0) return refuse(RefusalStatus::kImuGap, "a gap in the IMU");
        Initialization truth;
        truth.states = synthetic.truth;
        return truth;
      });
  WindowOptions options;
  options.refine = false;
  Starter starter(initializers, {}, options, {}, false);
  const auto make = [&](const WindowOptions&) { return problem; };
  ASSERT_EQ(starter.attempt(&window, make), Starter::Outcome::kStarts);
  for (size_t i = 0; i < Starter::kDetailedAttempts + 2; ++i)
    ASSERT_EQ(starter.attempt(&window, make), Starter::Outcome::kRefused);
  ASSERT_EQ(starter.attempts().size(), Starter::kDetailedAttempts + 3);
  EXPECT_TRUE(starter.attempts().front().accepted());
  EXPECT_TRUE(starter.attempts().front().init.has_value());
}

/** Stamps of the keyframes of the attempts at a flight of 20 Hz, ms after its first; the initializer
 * tells the truth from the attempt `first` on, with an error of b_g in the attempt `wrong`. */
std::vector<std::vector<int>> attemptsAt(const WindowOptions& options, bool windows_grow, int first,
                                         int wrong) {
  testing::SyntheticWindowOptions window_options;
  const testing::SyntheticWindow synthetic = testing::makeSyntheticWindow(window_options);
  int asked = 0;
  PipelineInitializers initializers;
  initializers.initializer =
      std::make_shared<Scripted>([&](const InitializationProblem& problem) -> InitializationResult {
        if (asked < first) return ++asked, refuse(RefusalStatus::kTooFewTracks, "none");
        Initialization truth;
        for (int k = 0; k < problem.keyframeCount(); ++k) {
          StampedState state;
          state.t = problem.keyframe(k).t;
          truth.states.push_back(state);
        }
        truth.covariance = 1e-6 * Eigen::MatrixXd::Identity(11, 11);
        if (asked++ == wrong) truth.bias.gyro.x() = 0.1;
        return truth;
      });
  Starter starter(initializers, {}, options, {}, windows_grow);
  KeyframeWindow window(10, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) {
    const bool keyframe = window.isKeyframe(frame.t);
    window.add(frame, keyframe);
    if (!keyframe || window.regularKeyframes() < 3) continue;
    const auto problem = [&](const WindowOptions& o) {
      return window.problem(synthetic.calibration, {}, o, synthetic.imu);
    };
    if (starter.attempt(&window, problem) != Starter::Outcome::kRefused) break;
  }
  std::vector<std::vector<int>> at;
  for (const InitializationAttempt& attempt : starter.attempts()) {
    at.emplace_back();
    for (const TimeNs t : attempt.keyframes)
      at.back().push_back(
          static_cast<int>(std::lround(1e3 * secondsBetween(synthetic.frames.front().t, t))));
  }
  return at;
}

/** The priors of 15 attempts at a window of 0.75 s of which the first `dark` see too few tracks, after
 * a loss `before_s` before its last keyframe. */
std::vector<BiasPriors> priorsAfterALoss(const BiasPriors& known, double before_s, int dark) {
  const testing::SyntheticWindowOptions window_options;
  const testing::SyntheticWindow synthetic = testing::makeSyntheticWindow(window_options);
  const InitializationProblem problem = testing::makeProblem(synthetic, window_options);
  KeyframeWindow window(3, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) window.add(frame, window.isKeyframe(frame.t));
  std::vector<BiasPriors> priors;
  PipelineInitializers initializers;
  initializers.initializer =
      std::make_shared<Scripted>([&](const InitializationProblem&) -> InitializationResult {
        return refuse(static_cast<int>(priors.size()) <= dark ? RefusalStatus::kTooFewTracks
                                                              : RefusalStatus::kNotConverged,
                      "as it always does");
      });
  ImuNoiseDensities noise;
  noise.gyro_random_walk = 1e-3;
  noise.accel_random_walk = 0.01;
  Starter starter(initializers, {}, WindowOptions(), noise, false);
  starter.knowBiases(window.stamps().back() - durationNs(before_s), known.mean,
                     known.sigma_gyro_rps, known.sigma_accel_mps2);
  for (int i = 0; i < 15; ++i)
    starter.attempt(&window, [&](const WindowOptions& o) {
      priors.push_back(o.priors);
      return problem;
    });
  return priors;
}

TEST(Starter, BiasesFromBeforeALossArePriorsForAWhile) {
  BiasPriors known;
  known.mean = {{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
  known.sigma_gyro_rps = 3e-3;
  known.sigma_accel_mps2 = 0.03;
  const BiasPriors usual = WindowOptions().priors;
  for (const int dark : {0, 2}) {
    const std::vector<BiasPriors> priors = priorsAfterALoss(known, 16.0, dark);
    for (int i = 0; i < 15; ++i) {
      const bool knows = i < Starter::kAttemptsWithKnownBiases + dark;
      EXPECT_EQ(priors[i].mean.accel, knows ? known.mean.accel : usual.mean.accel) << dark << i;
      EXPECT_EQ(priors[i].mean.gyro, knows ? known.mean.gyro : usual.mean.gyro) << dark << i;
      // 16 s of the random walks: 0.004 rad/s and 0.04 m/s^2.
      EXPECT_NEAR(priors[i].sigma_gyro_rps, knows ? 5e-3 : usual.sigma_gyro_rps, 1e-12);
      EXPECT_NEAR(priors[i].sigma_accel_mps2, knows ? 0.05 : usual.sigma_accel_mps2, 1e-12);
    }
  }
  // Never wider than without.
  EXPECT_EQ(priorsAfterALoss(known, 1e6, 0)[0].sigma_accel_mps2, usual.sigma_accel_mps2);
}

TEST(Starter, WhatLacksNothingButASecondWindowHasOneSooner) {
  WindowOptions options;
  options.refine = false;
  options.confirm_after_s = 0.1;
  EXPECT_THAT(attemptsAt(options, true, 0, -1),
              ElementsAre(ElementsAre(0, 250, 500), ElementsAre(0, 250, 500, 600)));
  // The attempt before it has no estimate.
  EXPECT_THAT(attemptsAt(options, true, 1, -1),
              ElementsAre(ElementsAre(0, 250, 500), ElementsAre(0, 250, 500, 750),
                          ElementsAre(0, 250, 500, 750, 850)));
  // Two that contradict each other: the windows go on at the rate, and keep the keyframe.
  EXPECT_THAT(attemptsAt(options, true, 0, 0),
              ElementsAre(ElementsAre(0, 250, 500), ElementsAre(0, 250, 500, 600),
                          ElementsAre(0, 250, 500, 600, 750)));
}

TEST(Starter, WithoutConfirmAfterAndWhereWindowsDoNotGrowKeyframesComeAtTheRate) {
  WindowOptions options;
  options.refine = false;
  options.confirm_after_s = 0.0;
  EXPECT_THAT(attemptsAt(options, true, 0, -1),
              ElementsAre(ElementsAre(0, 250, 500), ElementsAre(0, 250, 500, 750)));
  options.confirm_after_s = 0.1;
  EXPECT_THAT(attemptsAt(options, false, 1, -1),
              ElementsAre(ElementsAre(0, 250, 500), ElementsAre(0, 250, 500, 750)));
}

TEST(InitializationAttempt, AnOffsetThatIsFoundAddsToTheOneInUse) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& sample : samples) sample.t += 20'000'000;
  window.imu = ImuBuffer(samples);
  window.keyframe_indices.erase(window.keyframe_indices.begin());  // which it no longer covers
  const InitializationProblem problem = testing::makeProblem(window, options);
  const Scripted refusing([](const InitializationProblem&) {
    return refuse(RefusalStatus::kNotConverged, "as it always does");
  });
  WindowOptions in_use;
  in_use.time_offset_s = 0.0125;
  const auto found = attemptInitialization(problem, refusing, {}).time_offset,
             more = attemptInitialization(problem, refusing, in_use).time_offset;
  ASSERT_TRUE(found && more);
  EXPECT_NEAR(found->offset_s, 0.02, 3.0 * found->sigma_s);
  EXPECT_DOUBLE_EQ(more->offset_s, found->offset_s + 0.0125);
}

/** Without the residuals' check nothing could be refused by them. */
TEST(Refine, ChecksTheNoiseWhereTheAcceptanceJudgesByItOrItIsWanted) {
  const testing::SyntheticWindowOptions options;
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  Initialization truth;
  truth.states = window.truth;
  truth.bias = window.bias;
  const auto degreesOfFreedom = [&](double false_alarm_rate, bool wanted) {
    WindowOptions with;
    with.acceptance.false_alarm_rate = false_alarm_rate;
    with.check_noise = wanted;
    return refine(problem, truth, with, nullptr).noise.gyro.dof;
  };
  EXPECT_GT(degreesOfFreedom(0.001, false), 0.1);
  EXPECT_GT(degreesOfFreedom(0.0, true), 0.1);
  EXPECT_EQ(degreesOfFreedom(0.0, false), 0.0);
}

TEST(InitializationAttempt, WithoutItsEstimatesItStillSaysWhatHappened) {
  InitializationAttempt attempt;
  attempt.keyframes = {1, 2};
  attempt.init = Initialization();
  attempt.init->states.resize(2);
  attempt.init_timings = {{"solve", 1.0}};
  attempt.has_vi_ba = true;
  attempt.vi_ba.states.resize(2);
  attempt.vi_ba.covariance.resize(24, 24);
  attempt.landmarks[3] = Eigen::Vector3d::Zero();
  attempt.decision = refuse(RefusalStatus::kImplausible, "why");
  attempt.dropEstimates();
  EXPECT_FALSE(attempt.init);
  EXPECT_THAT(attempt.poses(), IsEmpty());
  EXPECT_EQ(attempt.vi_ba.covariance.size(), 0);
  EXPECT_THAT(attempt.landmarks, IsEmpty());
  EXPECT_THAT(attempt.keyframes, ElementsAre(1, 2));
  EXPECT_EQ(attempt.init_timings.size(), 1U);
  EXPECT_EQ(attempt.decision.error().reason, "why");
}

}  // namespace
}  // namespace etalon::pipeline_test
