#include "etalon/report/benchmark_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using testing::exampleBenchmark;
using testing::exampleResult;
using ::testing::HasSubstr;
using ::testing::Not;

PairedComparison find(const std::vector<PairedComparison>& comparisons, const std::string& stage,
                      const std::string& figure) {
  for (const PairedComparison& c : comparisons)
    if (c.stage == stage && c.figure == figure) return c;
  throw Error("no comparison of " + figure);
}

TEST(PairedComparison, PairsWindowsWhereBothHaveAValue) {
  const auto all = comparePaired(exampleBenchmark(), "good", "bad", comparedFigures());
  EXPECT_EQ(all.size(), 2 * (1 + windowMetrics().size()));
  const PairedComparison gravity = find(all, kStageInit, "gravity_deg");
  EXPECT_EQ(gravity.count_a, 5);
  EXPECT_EQ(gravity.count_b, 4);  // refused once
  EXPECT_EQ(gravity.interval.pairs, 4);
  EXPECT_DOUBLE_EQ(gravity.value_a, 1.25);               // of 1 2 1.5 0.5
  EXPECT_DOUBLE_EQ(gravity.value_b, 3.5);                // of 2 6 5 1.5
  EXPECT_DOUBLE_EQ(gravity.interval.difference, -2.25);  // of -1 -4 -3.5 -1
  EXPECT_EQ(gravity.verdict(), "too few pairs");
  const PairedComparison scale = find(all, kStageInit, "scale_error");
  EXPECT_EQ(scale.interval.pairs, 0);
  EXPECT_TRUE(std::isnan(scale.value_a));
}

TEST(PairedComparison, RefusalsEnterIntoSuccess) {
  const PairedComparison success = find(
      comparePaired(exampleBenchmark(), "good", "bad", {kSuccessRate}), kStageInit, kSuccessRate);
  EXPECT_EQ(success.count_a, 5);  // the window without ground truth is not judged
  EXPECT_EQ(success.count_b, 5);
  EXPECT_DOUBLE_EQ(success.value_a, 0.6);
  EXPECT_DOUBLE_EQ(success.value_b, 0.2);
  EXPECT_NEAR(success.interval.difference, 0.4, 1e-15);
}

/** `count` windows; b's gravity is off by `more` degrees more, on average. */
BenchmarkRecord manyResults(int count, double more) {
  BenchmarkRecord record;
  for (int window = 10; window < 10 + count; ++window) {
    const double wobble = 0.1 * std::sin(window), shared = 1.0 + 0.5 * std::sin(7.0 * window);
    record.results.push_back(exampleResult("V1", window, "a", {true, true, shared}));
    record.results.push_back(
        exampleResult("V1", window, "b", {true, true, shared + more + wobble}));
  }
  return record;
}

TEST(PairedComparison, SaysWhichIsBetterOrThatNoneIs) {
  const auto verdict = [](const BenchmarkRecord& record, const std::string& a,
                          const std::string& b) {
    return comparePaired(record, a, b, {"gravity_deg"}).front().verdict();
  };
  // The spread of a window's gravity is 0.35 deg; that of the difference is 0.07.
  EXPECT_EQ(verdict(manyResults(40, 0.1), "a", "b"), "a is better, this recording alone");
  EXPECT_EQ(verdict(manyResults(40, 0.1), "b", "a"), "a is better, this recording alone");
  EXPECT_EQ(verdict(manyResults(40, 0.0), "a", "b"), "no significant difference");
  // More success is better, less error is: every window of b fails from 2 deg on.
  const BenchmarkRecord failing = manyResults(40, 2.0);
  EXPECT_EQ(comparePaired(failing, "b", "a", {kSuccessRate}).front().verdict(),
            "a is better, this recording alone");
  EXPECT_EQ(comparePaired(failing, "a", "b", {kSuccessRate}).front().verdict(),
            "a is better, this recording alone");
}

/** Recordings of 30 windows, `every_ns` from window to window; b's gravity is off by so many
 * degrees more.
 */
BenchmarkRecord recordings(const std::vector<double>& more, TimeNs every_ns = 2'500'000'000) {
  BenchmarkRecord record;
  for (size_t r = 0; r < more.size(); ++r)
    for (int window = 0; window < 30; ++window) {
      const double wobble = 0.1 * std::sin(3.0 * window + static_cast<double>(r));
      const std::string name = "V" + std::to_string(r);
      record.results.push_back(exampleResult(name, window, "a", {true, true, 1.0 + wobble}));
      record.results.push_back(exampleResult(name, window, "b", {true, true, 1.0 + more[r]}));
      for (size_t i = record.results.size() - 2; i < record.results.size(); ++i)
        record.results[i].t0 = every_ns * window;
    }
  return record;
}

TEST(PairedComparison, ARecordingCountsAsOneNotAsItsWindows) {
  const auto compared = [](const BenchmarkRecord& record) {
    return comparePaired(record, "a", "b", {"gravity_deg"}).front();
  };
  // In 120 of 180 windows b is worse, but only in four of six recordings.
  const PairedComparison mixed = compared(recordings({0.3, -0.2, 0.3, 0.3, -0.2, 0.3}));
  EXPECT_EQ(mixed.interval.pairs, 180);
  EXPECT_EQ(mixed.interval.clusters, 6);
  EXPECT_EQ(mixed.verdict(), "no significant difference");
  ASSERT_EQ(mixed.by_recording.size(), 6u);
  EXPECT_EQ(mixed.by_recording[1].sequence, "V1");
  EXPECT_EQ(mixed.by_recording[1].pairs, 30);
  EXPECT_NEAR(mixed.by_recording[0].difference, -0.3, 0.03);
  EXPECT_NEAR(mixed.by_recording[1].difference, 0.2, 0.03);
  EXPECT_EQ(compared(recordings({0.3, 0.2, 0.3, 0.3, 0.2, 0.3})).verdict(), "a is better");
  EXPECT_EQ(compared(recordings({0.3})).verdict(), "a is better, this recording alone");
}

TEST(PairedComparison, OverlappingWindowsAreNotIndependent) {
  // Windows of 2.25 s: at 2.5 s apart, at 2.25 s with a keyframe in common, at 0.25 s nine overlap.
  const auto width = [](TimeNs every_ns) {
    const PairedComparison c =
        comparePaired(recordings({0.0}, every_ns), "a", "b", {"gravity_deg"}).front();
    return c.interval.high - c.interval.low;
  };
  EXPECT_EQ(width(2'500'000'000), width(2'250'000'000));
  EXPECT_NE(width(2'500'000'000), width(250'000'000));
  // Where nine of 30 windows overlap, only four do not overlap each other.
  const PairedComparison few =
      comparePaired(recordings({0.3}, 250'000'000), "a", "b", {"gravity_deg"}).front();
  EXPECT_EQ(few.interval.pairs, 30);
  EXPECT_EQ(few.apart, 4);
  EXPECT_EQ(few.verdict(), "too few pairs");
}

TEST(ComparisonTable, SaysForWhichRecordingsItHolds) {
  const BootstrapOptions options;
  const auto table = [&](const std::vector<double>& more) {
    return comparisonTable(comparePaired(recordings(more), "a", "b", {"gravity_deg"}), options);
  };
  EXPECT_THAT(table({0.3}).note, HasSubstr("hold for this flight alone"));
  EXPECT_THAT(table({0.3, 0.3}).note, HasSubstr("There are 2 recordings: too few"));
  const TitledTable many = table({0.3, 0.2, 0.3, 0.2, 0.3, 0.2});
  EXPECT_THAT(many.note, Not(HasSubstr("too few")));
  EXPECT_THAT(many.table.toString(TableFormat::kText), HasSubstr("A - B by recording"));
  EXPECT_EQ(many.table.numberAt(0, "recordings"), 6);
  EXPECT_NEAR(many.table.numberAt(0, "difference_V1"), -0.2, 0.03);
}

TEST(PairedComparison, ATinyDifferenceIsNotRelevantHoweverSureItIs) {
  const auto compared = [](double more) {
    BenchmarkRecord record;
    for (int window = 10; window < 50; ++window) {
      const double shared = 1.0 + 0.5 * std::sin(7.0 * window);
      record.results.push_back(exampleResult("V1", window, "a", {true, true, shared}));
      record.results.push_back(exampleResult("V1", window, "b", {true, true, shared + more}));
    }
    return comparePaired(record, "a", "b", {"gravity_deg", "rre_deg"});
  };
  const PairedComparison tiny = compared(6.5e-10).front();
  EXPECT_TRUE(tiny.interval.significant());
  EXPECT_EQ(tiny.verdict(), "no relevant difference");
  // 1 % of the smaller median, which is about 1 deg.
  EXPECT_DOUBLE_EQ(tiny.smallestRelevantDifference(), 0.01 * tiny.value_a);
  EXPECT_EQ(compared(0.005).front().verdict(), "no relevant difference");
  EXPECT_EQ(compared(0.02).front().verdict(), "a is better, this recording alone");

  PairedComparison small;  // the median is so small that the last digit decides
  small.figure = "rre_deg";
  small.value_a = small.value_b = 1e-3;
  EXPECT_DOUBLE_EQ(small.smallestRelevantDifference(), 1e-4);
  small.figure = "ate_m";  // printed as mm with two digits
  EXPECT_DOUBLE_EQ(small.smallestRelevantDifference(), 1e-5);
  small.figure = kSuccessRate;
  EXPECT_DOUBLE_EQ(small.smallestRelevantDifference(), 1e-3);
}

TEST(PairedComparison, RefusesUnknownFigures) {
  EXPECT_THROW(comparePaired(exampleBenchmark(), "good", "bad", {"speed"}), ConfigError);
}

TEST(CombineBenchmarks, NamesWhatBothHaveAfterTheBenchmark) {
  BenchmarkRecord one = exampleBenchmark(), two = exampleBenchmark();
  for (WindowResult& result : two.results)
    if (result.initializer == "bad") result.initializer = "other";
  two.initializers[1].name = "other";
  const BenchmarkRecord all = combineBenchmarks({{"old", one}, {"new", two}});
  EXPECT_THAT(initializersOf(all), ElementsAre("old/good", "bad", "new/good", "other"));
  EXPECT_EQ(all.initializers.size(), 4u);
  EXPECT_EQ(all.initializers[2].name, "new/good");
  EXPECT_EQ(all.sequences.size(), 2u);
  one.protocol.min_coverage = 0.2;
  EXPECT_EQ(combineBenchmarks({{"old", one}}).protocol.min_coverage, 0.2);
  EXPECT_EQ(combineBenchmarks({{"old", one}, {"new", two}}).protocol.min_coverage, 0.5);
  const PairedComparison same =
      find(comparePaired(all, "old/good", "new/good", {"gravity_deg"}), kStageViBa, "gravity_deg");
  EXPECT_EQ(same.interval.pairs, 5);
  EXPECT_EQ(same.interval.low, 0.0);
  EXPECT_EQ(same.interval.high, 0.0);

  one.sequences[0].content = "abc";
  two.sequences[0].content = "def";
  EXPECT_THROW(combineBenchmarks({{"old", one}, {"new", two}}), ConfigError);
  two.sequences[0].content.clear();  // nothing of it was tried
  EXPECT_NO_THROW(combineBenchmarks({{"old", one}, {"new", two}}));
}

TEST(SelectInitializers, KeepsTheseInThisOrder) {
  const BenchmarkRecord record = selectInitializers(exampleBenchmark(), {"bad", "good"});
  EXPECT_THAT(initializersOf(record), ElementsAre("bad", "good"));
  EXPECT_EQ(record.results.size(), exampleBenchmark().results.size());
  EXPECT_THAT(initializersOf(selectInitializers(record, {"good"})), ElementsAre("good"));
  try {
    selectInitializers(record, {"best"});
    FAIL() << "accepted";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("'best': expected one of bad, good"));
  }
}

TEST(ComparisonTable, TextsForPeopleAndNumbersForPrograms) {
  const BootstrapOptions options;
  const TitledTable table = comparisonTable(
      comparePaired(manyResults(40, 0.1), "a", "b", {kSuccessRate, "ate_m"}, options), options);
  EXPECT_THAT(table.note,
              HasSubstr("95 %, paired percentile bootstrap of recordings and their windows, 10000 "
                        "resamples, seed 1"));
  EXPECT_THAT(table.note, HasSubstr("4 comparisons were made, without a correction"));
  const std::string text = table.table.toString(TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("ATE [mm]"));
  EXPECT_THAT(text, HasSubstr("a is better, this recording alone"));
  const std::string csv = table.table.toString(TableFormat::kCsv);
  ASSERT_EQ(table.table.rowCount(), 4u);
  EXPECT_EQ(table.table.textAt(1, "figure"), "ate_m");
  EXPECT_EQ(table.table.numberAt(1, "pairs"), 40);
  EXPECT_LT(table.table.numberAt(1, "high"), 0.0);
  EXPECT_GT(table.table.numberAt(1, "low"), -0.003);  // in metres
  EXPECT_THAT(csv, Not(HasSubstr("low_text")));
  EXPECT_THAT(csv, Not(HasSubstr("title")));
}

}  // namespace
}  // namespace etalon
