#include "etalon/benchmark/ground_truth_coverage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/testing/example_benchmark.h"
#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr TimeNs kMs = 1'000'000;

Trajectory every(TimeNs step_ms, TimeNs first_ms, TimeNs last_ms) {
  Trajectory trajectory;
  for (TimeNs t = first_ms; t <= last_ms; t += step_ms) trajectory.push_back({t * kMs, SE3()});
  return trajectory;
}

TEST(Coverage, NineOfAHundredAreNotEnoughNorAreTwoOfFour) {
  EXPECT_FALSE(coversEnough(9, 100, kMinCoverage));
  EXPECT_TRUE(coversEnough(50, 100, kMinCoverage));
  EXPECT_FALSE(coversEnough(2, 4, kMinCoverage));
  EXPECT_TRUE(coversEnough(2, 2, kMinCoverage));
  EXPECT_FALSE(coversEnough(0, 0, 0.0));
  EXPECT_TRUE(coversEnough(9, 100, 0.05));
}

TEST(Coverage, AReferenceOfALowerRateCoversWhatIsBetweenItsPoses) {
  const Trajectory estimate = every(50, 0, 5000);  // 101 poses
  EXPECT_EQ(coveredPoses(estimate, associate(estimate, every(100, 0, 5000))), 101U);
  EXPECT_EQ(coveredPoses(estimate, associate(estimate, every(50, 1000, 1400))), 9U);
  EXPECT_EQ(coveredPoses(estimate, associate(estimate, every(2000, 0, 5000))), 3U);
  EXPECT_EQ(coveredPoses(estimate, associate(estimate, every(50, 90'000, 95'000))), 0U);
}

TEST(Coverage, ErrorsOfAWindowBarelyCoveredAreNotKnown) {
  RunRecord run = testing::exampleRecord();
  StageRecord& stage = run.attempts.back().stages.back();
  ASSERT_TRUE(stage.errors);
  ASSERT_GE(stage.states.size(), 3U);
  stage.errors->keyframes = 1;
  run.ground_truth = GroundTruthUse{100, 9};
  requireCoverage(&run, kMinCoverage);
  const WindowErrors& errors = *run.attempts.back().stages.back().errors;
  EXPECT_EQ(errors.keyframes, 1);
  EXPECT_TRUE(std::isnan(errors.ate_m) && std::isnan(errors.rre_deg));
  EXPECT_FALSE(errors.success());
  EXPECT_FALSE(run.trajectory_errors);
}

TEST(Coverage, IsToldInASentence) {
  EXPECT_THAT(describeCoverage({100, 100}, 0.5), IsEmpty());
  EXPECT_EQ(describeCoverage({100, 99}, 0.5), "ground truth covers 99 of 100 frames (99 %)");
  EXPECT_THAT(describeCoverage({100, 9}, 0.5),
              AllOf(HasSubstr("9 of 100 frames (9 %)"), HasSubstr("at least 50 % is wanted")));
  EXPECT_THAT(describeCoverage({100, 0}, 0.5), HasSubstr("is it on the same clock?"));
}

TEST(Coverage, PercentAreRoundedDownButNotByRounding) {
  // 0.29 and 0.57 are a little less than that in binary.
  EXPECT_THAT(describeCoverage({100, 29}, 0.57),
              AllOf(HasSubstr("29 of 100 frames (29 %)"), HasSubstr("at least 57 % is wanted")));
  EXPECT_THAT(describeCoverage({10'000, 9'999}, 0.5), HasSubstr("(99 %)"));
}

TEST(Coverage, OfBothTrajectoriesAndOfABenchmarksWindows) {
  RunRecord run = testing::exampleRecord();
  run.smoothed_errors = run.final_errors = run.trajectory_errors;
  run.ground_truth = GroundTruthUse{100, 50};
  requireCoverage(&run, 0.5);
  EXPECT_TRUE(run.trajectory_errors && run.smoothed_errors && run.final_errors);
  run.ground_truth = GroundTruthUse{100, 49};
  requireCoverage(&run, 0.5);
  EXPECT_FALSE(run.trajectory_errors || run.smoothed_errors || run.final_errors);

  BenchmarkRecord record = testing::exampleBenchmark();
  for (WindowResult& result : record.results) {
    result.attempt.keyframes.resize(10);
    result.truth.resize(10);
  }
  EXPECT_THAT(describeCoverage(record), IsEmpty());
  record.results[1].attempt.keyframes.resize(3);  // a window that grew, accepted before its end
  record.results[1].truth.resize(3);
  EXPECT_THAT(describeCoverage(record), IsEmpty());
  record.results[0].truth.resize(4);  // of 10 keyframes
  const std::vector<std::string> one = describeCoverage(record);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_THAT(one[0], AllOf(HasSubstr("V1: ground truth covers 9 of 10 results"),
                            HasSubstr("each by 50 % of its keyframes")));
  for (WindowResult& result : record.results) result.truth.clear();
  EXPECT_THAT(describeCoverage(record)[0], HasSubstr("is it on the same clock?"));
  for (BenchmarkSequence& sequence : record.sequences) sequence.has_ground_truth = false;
  EXPECT_THAT(describeCoverage(record)[0], HasSubstr("V1: there is no ground truth; the errors"));
}

}  // namespace
}  // namespace etalon
