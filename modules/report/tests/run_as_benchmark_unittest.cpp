#include "run_as_benchmark.h"

#include <gtest/gtest.h>

#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using testing::kFirstImage;

/** Ground truth every 50 ms from a second before the first image on. */
GroundTruth groundTruth() {
  GroundTruth truth;
  for (int i = -20; i < 40; ++i) {
    StampedState state;
    state.t = kFirstImage + 50'000'000LL * i;
    state.T_WB.t.x() = 0.1 * i;
    truth.states.push_back(state);
  }
  return truth;
}

TEST(RunAsBenchmark, EveryAttemptIsAWindow) {
  const RunRecord run = testing::exampleRecord();
  const BenchmarkRecord benchmark = benchmarkOfRun(run, groundTruth());
  ASSERT_EQ(benchmark.sequences.size(), 1U);
  ASSERT_EQ(benchmark.initializers.size(), 1U);
  EXPECT_EQ(benchmark.initializers[0].name, "eta");
  EXPECT_EQ(benchmark.initializers[0].version, "1.2");
  EXPECT_EQ(benchmark.sequences[0].first_image, kFirstImage);
  EXPECT_EQ(benchmark.sequences[0].warnings, run.warnings);
  EXPECT_TRUE(benchmark.sequences[0].has_ground_truth);
  EXPECT_TRUE(benchmark.protocol.vi_ba);
  ASSERT_EQ(benchmark.results.size(), run.attempts.size());
  for (size_t i = 0; i < run.attempts.size(); ++i) {
    const WindowResult& result = benchmark.results[i];
    EXPECT_EQ(result.window, static_cast<int>(i));
    EXPECT_EQ(result.t0, run.attempts[i].keyframes.front());
    EXPECT_EQ(result.attempt.status, run.attempts[i].status);
    EXPECT_EQ(result.sequence, benchmark.sequences[0].name);
    EXPECT_EQ(result.initializer, "eta");
  }
}

TEST(RunAsBenchmark, TheShapeIsThatOfTheLongestWindow) {
  // 2 keyframes in the refused attempt, 3 in the accepted one, 250 ms apart.
  for (const WindowResult& result :
       benchmarkOfRun(testing::exampleRecord(), GroundTruth()).results) {
    EXPECT_EQ(result.keyframes, 3);
    EXPECT_DOUBLE_EQ(result.rate_hz, 4.0);
  }
}

TEST(RunAsBenchmark, TruthIsThatOfItsOwnKeyframes) {
  const RunRecord run = testing::exampleRecord();
  const BenchmarkRecord benchmark = benchmarkOfRun(run, groundTruth());
  ASSERT_EQ(benchmark.results[0].truth.size(), 2U);
  ASSERT_EQ(benchmark.results[1].truth.size(), 3U);
  for (size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(benchmark.results[1].truth[k].T_WB.t.x(), 0.5 * static_cast<double>(k), 1e-6);
  const BenchmarkRecord without = benchmarkOfRun(run, GroundTruth());
  EXPECT_FALSE(without.sequences[0].has_ground_truth);
  EXPECT_TRUE(without.results[1].truth.empty());
}

TEST(RunAsBenchmark, IsNamedAfterTheLastPartOfItsSource) {
  RunRecord run = testing::exampleRecord();
  const auto name = [&run](const std::string& source) {
    run.source = source;
    return benchmarkOfRun(run, GroundTruth()).sequences[0].name;
  };
  EXPECT_EQ(name("/data/V1_02_medium"), "V1_02_medium");
  EXPECT_EQ(name("/data/V1_02_medium//"), "V1_02_medium");
  EXPECT_EQ(name("flight.rawlog"), "flight.rawlog");
}

TEST(RunAsBenchmark, WithoutAttemptsOrViBaThereIsNone) {
  RunRecord run = testing::exampleRecord();
  run.attempts.back().stages.pop_back();
  EXPECT_FALSE(benchmarkOfRun(run, GroundTruth()).protocol.vi_ba);
  run.attempts.clear();
  EXPECT_TRUE(benchmarkOfRun(run, GroundTruth()).results.empty());
}

/** A crash before the first window: an attempt without keyframes stands at its own time. */
TEST(RunAsBenchmark, AnAttemptWithoutKeyframesHasItsOwnStamp) {
  RunRecord run = testing::exampleRecord();
  AttemptRecord lost;
  lost.t = kFirstImage + 7;
  lost.status = kStatusCrashed;
  run.attempts = {lost};
  const BenchmarkRecord benchmark = benchmarkOfRun(run, groundTruth());
  ASSERT_EQ(benchmark.results.size(), 1U);
  EXPECT_EQ(benchmark.results[0].t0, kFirstImage + 7);
  EXPECT_EQ(benchmark.results[0].keyframes, 0);
}

}  // namespace
}  // namespace etalon
