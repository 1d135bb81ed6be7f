#include "etalon/initialization/initialization_problem.h"

#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/initialization/initialization_result.h"

namespace etalon {
namespace {

InitializationProblem::Data threeFrames() {
  InitializationProblem::Data data;
  for (const TimeNs t : {0, 50'000'000, 100'000'000}) data.frames.push_back({t, {}});
  data.keyframe_indices = {0, 2};
  std::vector<ImuSample> samples;
  for (TimeNs t = 0; t <= 100'000'000; t += 5'000'000) {
    samples.push_back({t, {0.0, 0.0, 0.1}, {0.0, 0.0, 9.81}});
  }
  data.imu = ImuBuffer(samples);
  return data;
}

TEST(InitializationProblem, GivesKeyframesAndTheirPreintegrations) {
  const InitializationProblem problem(threeFrames(), nullptr);
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
    EXPECT_THROW(InitializationProblem(data, nullptr), DataError);
  }
}

TEST(InitializationProblem, ComputesTheVisualSolutionOnceAndOnlyWhenAsked) {
  int calls = 0;
  const InitializationProblem problem(threeFrames(), [&calls] {
    ++calls;
    VisualSolution solution;
    solution.inliers = 7;
    return solution;
  });
  const InitializationProblem copy = problem;
  EXPECT_FALSE(problem.visualSolutionComputed());
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(problem.visualSolution().inliers, 7);
  EXPECT_EQ(copy.visualSolution().inliers, 7);
  EXPECT_TRUE(copy.visualSolutionComputed());
  EXPECT_GE(copy.visualSolutionMilliseconds(), 0.0);
  EXPECT_EQ(calls, 1);
}

TEST(InitializationProblem, RepeatsTheErrorOfTheVisualSolver) {
  int calls = 0;
  const InitializationProblem problem(threeFrames(), [&calls]() -> VisualSolution {
    ++calls;
    throw Error("too dark");
  });
  EXPECT_THROW(problem.visualSolution(), Error);
  EXPECT_THROW(problem.visualSolution(), Error);
  EXPECT_EQ(calls, 1);
  EXPECT_THROW(InitializationProblem(threeFrames(), nullptr).visualSolution(), ConfigError);
}

TEST(InitializationStatus, HasANameForEveryValue) {
  EXPECT_STREQ(toString(InitializationStatus::kSuccess), "success");
  EXPECT_STREQ(toString(InitializationStatus::kTooFewTracks), "too_few_tracks");
  EXPECT_STREQ(toString(InitializationStatus::kImplausible), "implausible");
}

}  // namespace
}  // namespace etalon
