#include "window_trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon::trial_test {

/** The inertial-only MAP on stereo odometry, or a refusal. */
class TestInitializer : public Initializer {
  DEFINE_MRPT_OBJECT(TestInitializer, etalon::trial_test)

 public:
  explicit TestInitializer(bool refuses = false) : refuses_(refuses) {}
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    if (refuses_) return refuse(RefusalStatus::kTooFewTracks, "too few");
    const Expected<InertialOnlyStep> step = solveInertialOnlyStep(problem, {});
    if (!step) return refuse(step.error());
    const VisualSolution& visual = *problem.visualSolution();
    return alignWithGravity(
        problem,
        {visual.T_VB, step->map.v_VB, step->map.g_V, visual.landmarks, step->map.bias, {}});
  }

 private:
  bool refuses_;
};

IMPLEMENTS_MRPT_OBJECT(TestInitializer, etalon::Initializer, etalon::trial_test)

}  // namespace etalon::trial_test

namespace etalon {
namespace {

ConfiguredInitializer named(const std::string& name, bool refuses = false) {
  ConfiguredInitializer configured;
  configured.plugin.name = name;
  configured.initializer = std::make_shared<trial_test::TestInitializer>(refuses);
  return configured;
}

/** A recording of 20 keyframes' time, cut into windows of 10. */
class Trial : public ::testing::Test {
 protected:
  Trial() {
    testing::SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.keyframes = 20;
    options.sigma_px = options.assumed_sigma_px = 0.5;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    const testing::SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
    tracks.calibration = synthetic.calibration;
    tracks.imu = synthetic.imu;
    tracks.frames = synthetic.frames;
    tracks.first_image = synthetic.frames.front().t;
    tracks.ground_truth.has_velocity = tracks.ground_truth.has_biases = true;
    for (const StampedState& s : synthetic.truth) {
      StampedState state;
      state.t = s.t;
      state.T_WB = s.T_WB;
      state.v_WB = s.v_WB;
      tracks.ground_truth.states.push_back(state);
    }
    options_.odometry.sigma_px = 0.5;
  }

  WindowTrial window(int number, int keyframes = 10, int min_keyframes = 0) const {
    WindowResult result;
    result.sequence = "flight";
    result.window = number;
    result.keyframes = keyframes;
    result.rate_hz = 4.0;
    BenchmarkProtocol protocol;
    protocol.min_keyframes = min_keyframes;
    return WindowTrial(result, tracks, check, protocol, {}, options_);
  }

  SequenceTracks tracks;
  GroundTruthCheck check;
  WindowOptions options_;
};

TEST_F(Trial, RecordsWhereTheWindowIsAndWhatIsTrueThere) {
  const WindowResult result = window(1).tryWith(named("map"));
  EXPECT_EQ(result.initializer, "map");
  EXPECT_EQ(result.sequence, "flight");
  EXPECT_EQ(result.t0, tracks.first_image + 2'500'000'000);
  ASSERT_EQ(result.attempt.keyframes.size(), 10U);
  EXPECT_EQ(result.attempt.keyframes.front(), result.t0);
  EXPECT_EQ(result.attempt.t, result.attempt.keyframes.back());
  ASSERT_EQ(result.truth.size(), 10U);
  for (size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(result.truth[k].t, result.attempt.keyframes[k]);
    EXPECT_LT((result.truth[k].T_WB.t - tracks.ground_truth.states[10 + k].T_WB.t).norm(), 1e-9);
  }
  EXPECT_GT(result.truth_check.rre_deg, 0.0);
}

TEST_F(Trial, AnEstimateHasBothStagesTheirErrorsAndNoCovariance) {
  const WindowResult result = window(0).tryWith(named("map"));
  ASSERT_TRUE(result.attempt.accepted()) << result.attempt.reason;
  for (const char* name : {kStageInit, kStageViBa}) {
    const StageRecord* stage = result.attempt.stage(name);
    ASSERT_NE(stage, nullptr) << name;
    ASSERT_TRUE(stage->errors);
    EXPECT_LT(stage->errors->gravity_deg, 2.0);
    EXPECT_EQ(stage->covariance.size(), 0);
    EXPECT_TRUE(stage->covariance_order.empty());
  }
  // The benchmark reads the noise check of every window.
  ASSERT_TRUE(result.noise);
  EXPECT_GT(result.noise->vision.dof, 100.0);
  EXPECT_NEAR(result.noise->vision.chi2 / result.noise->vision.dof, 1.0, 0.2);
}

TEST_F(Trial, AWindowGrowsUntilTwoAgreeOnWhatIsWanted) {
  const WindowResult whole = window(0).tryWith(named("map"));
  EXPECT_DOUBLE_EQ(whole.seconds(), 2.25);
  // The second window of three that could be accepted agrees with the first.
  const WindowResult grown = window(0, 10, 3).tryWith(named("map"));
  ASSERT_TRUE(grown.attempt.accepted()) << grown.attempt.reason;
  EXPECT_EQ(grown.keyframes, 10);  // it is the same window of the benchmark
  EXPECT_EQ(grown.t0, whole.t0);
  EXPECT_LT(grown.seconds(), whole.seconds());
  EXPECT_GE(grown.attempt.keyframes.size(), 4U);
  EXPECT_EQ(grown.truth.size(), grown.attempt.keyframes.size());
  EXPECT_EQ(grown.attempt.stages.back().states.size(), grown.attempt.keyframes.size());
  // An additional keyframe confirms it sooner.
  options_.confirm_after_s = 0.1;
  const WindowResult sooner = window(0, 10, 3).tryWith(named("map"));
  ASSERT_TRUE(sooner.attempt.accepted()) << sooner.attempt.reason;
  EXPECT_NEAR(grown.seconds() - sooner.seconds(), 0.15, 1e-6);
  EXPECT_EQ(sooner.attempt.keyframes.size(), grown.attempt.keyframes.size());
  // What cannot be met makes it grow to the end.
  options_.acceptance.velocity_mps = 0.0;
  const WindowResult refused = window(0, 6, 3).tryWith(named("map"));
  EXPECT_EQ(refused.attempt.status, "ill_conditioned");
  EXPECT_EQ(refused.attempt.keyframes.size(), 6U);
}

TEST_F(Trial, IsTheSameEveryTimeAndOfEveryInitializer) {
  const WindowTrial trial = window(0);
  const WindowResult a = trial.tryWith(named("a")), b = trial.tryWith(named("b"));
  EXPECT_EQ(a.attempt.stages.back().bias.gyro, b.attempt.stages.back().bias.gyro);
  EXPECT_EQ(a.attempt.stages.back().states.back().T_WB.t,
            b.attempt.stages.back().states.back().T_WB.t);
}

TEST_F(Trial, ARefusalKeepsItsReason) {
  const WindowResult result = window(0).tryWith(named("shy", true));
  EXPECT_EQ(result.attempt.status, "too_few_tracks");
  EXPECT_EQ(result.attempt.reason, "too few");
  EXPECT_TRUE(result.attempt.stages.empty());
  EXPECT_FALSE(result.noise);
  EXPECT_EQ(result.truth.size(), 10U);
}

TEST_F(Trial, AnInitializerThatDidNotComeBackLosesTheWindowAlone) {
  const WindowResult result = window(1).lost("crasher", kStatusCrashed, "crashed with signal 11");
  EXPECT_EQ(result.initializer, "crasher");
  EXPECT_EQ(result.attempt.status, kStatusCrashed);
  EXPECT_EQ(result.attempt.reason, "crashed with signal 11");
  EXPECT_EQ(result.t0, tracks.first_image + 2'500'000'000);
  EXPECT_EQ(result.truth.size(), 10U);
  EXPECT_TRUE(result.attempt.stages.empty());
}

TEST_F(Trial, WithoutGroundTruthThereAreNoErrors) {
  tracks.ground_truth = GroundTruth();
  const WindowResult result = window(0).tryWith(named("map"));
  EXPECT_TRUE(result.truth.empty());
  ASSERT_FALSE(result.attempt.stages.empty());
  for (const StageRecord& stage : result.attempt.stages) EXPECT_FALSE(stage.errors);
}

}  // namespace
}  // namespace etalon
