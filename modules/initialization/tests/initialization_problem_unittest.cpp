#include "etalon/initialization/initialization_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

InitializationProblem::Data threeFrames() {
  InitializationProblem::Data data;
  for (const TimeNs t : {0, 50'000'000, 100'000'000}) data.frames.push_back({t, {}, {}});
  data.keyframe_indices = {0, 2};
  std::vector<ImuSample> samples;
  for (TimeNs t = 0; t <= 100'000'000; t += 5'000'000) {
    samples.push_back({t, {0.0, 0.0, 0.1}, {0.0, 0.0, 9.81}});
  }
  data.imu = ImuBuffer(samples);
  return data;
}

TEST(InitializationProblem, GivesKeyframesAndTheirPreintegrations) {
  const InitializationProblem problem(threeFrames());
  ASSERT_EQ(problem.keyframeCount(), 2);
  EXPECT_EQ(problem.keyframe(1).t, 100'000'000);
  const auto preintegrations = problem.preintegrate(ImuBias());
  ASSERT_EQ(preintegrations.size(), 1U);
  EXPECT_EQ(preintegrations[0].start(), 0);
  EXPECT_EQ(preintegrations[0].end(), 100'000'000);
}

TEST(InitializationProblem, RefusesKeyframeIndicesOutOfRangeOrOrder) {
  for (const std::vector<int>& indices : {std::vector<int>{0, 3}, {-1, 2}, {2, 0}, {1, 1}}) {
    InitializationProblem::Data data = threeFrames();
    data.keyframe_indices = indices;
    EXPECT_THROW(InitializationProblem(std::move(data)), DataError);
  }
}

TEST(InitializationProblem, ComputesTheVisualSolutionOnceAndOnlyWhenAsked) {
  const testing::SyntheticWindowOptions options;
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = testing::makeProblem(window, options);
  const InitializationProblem copy = problem;
  EXPECT_FALSE(problem.visualSolutionComputed());
  EXPECT_EQ(problem.visualSolutionMilliseconds(), 0.0);
  const Expected<VisualSolution>& solution = problem.visualSolution();
  EXPECT_EQ(solution->T_VB.size(), window.truth.size());
  EXPECT_TRUE(copy.visualSolutionComputed());
  EXPECT_EQ(&copy.visualSolution(), &solution);
  EXPECT_GT(copy.visualSolutionMilliseconds(), 0.0);
}

TEST(InitializationProblem, SaysAtEveryCallThatAKeyframeCannotBeLocated) {
  const InitializationProblem problem(threeFrames());  // without any track
  for (int call = 0; call < 2; ++call) {
    const Expected<VisualSolution>& solution = problem.visualSolution();
    ASSERT_FALSE(solution);
    EXPECT_EQ(solution.error().status, RefusalStatus::kTooFewTracks);
    EXPECT_EQ(solution.error().value, 0.0);
    EXPECT_THAT(solution.error().reason, ::testing::HasSubstr("keyframe 1: 0 measurements agree"));
  }
}

}  // namespace
}  // namespace etalon
