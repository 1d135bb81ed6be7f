#include "etalon/report/benchmark_overview.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string overviewOf(const BenchmarkRecord& record) {
  return toString(overviewTable(record, summarize(record), shapesOf(record).front()),
                  TableFormat::kText, {CellMark::kStar, 100});
}

TEST(BenchmarkOverview, HoldsARowForEachInitializer) {
  const std::string text = overviewOf(testing::exampleBenchmark());
  EXPECT_THAT(text, HasSubstr("2 recordings, 10 keyframes at 4 Hz"));
  // Medians over the windows with an estimate: of 1 2 3 1.5 0.5, and half of it after VI-BA.
  EXPECT_THAT(text, HasSubstr("\ngood          60.0  0.1500  15.00   1.50  0.0150"));
  EXPECT_THAT(text, HasSubstr("6 windows. "));
  EXPECT_THAT(text, HasSubstr("\nBest marked *, of the initializers with an estimate"));
}

TEST(BenchmarkOverview, FitsAScreenWithAllInitializers) {
  BenchmarkRecord record;
  for (int window = 0; window < 4; ++window)
    for (int i = 0; i < 13; ++i)
      record.results.push_back(testing::exampleResult(
          "V1", window, std::string("orbslam3_inertial_onl") + static_cast<char>('a' + i),
          {true, true, 1.5 + 0.1 * i}));
  std::istringstream text(overviewOf(record));
  int lines = 0;
  for (std::string line; std::getline(text, line); ++lines) EXPECT_LE(line.size(), 100u) << line;
  EXPECT_LE(lines, 25);
}

/** The record without the results of an initializer. */
BenchmarkRecord without(const std::string& initializer, BenchmarkRecord record) {
  record.results.erase(
      std::remove_if(record.results.begin(), record.results.end(),
                     [&](const WindowResult& r) { return r.initializer == initializer; }),
      record.results.end());
  return record;
}

/** After VI-BA, by `velocity` above the limit of a claim of 3.5 standard deviations. */
void claimTooMuch(WindowResult* result) {
  result->attempt.stages.back().errors->velocity_nees = 6.0;
}

TEST(BenchmarkOverview, NamesWhoAcceptedFalselyAndWhere) {
  BenchmarkRecord record = testing::exampleBenchmark();
  record.sequences[0].first_image = -100'000'000;
  EXPECT_THAT(overviewOf(record),
              HasSubstr("6 windows. False accepts: 1 by bad: V1 at 2.6 s: no success.\nsucc.:"));
  EXPECT_THAT(overviewOf(without("good", record)),
              HasSubstr("6 windows. False accepts: 1 (V1 at 2.6 s: no success).\nsucc.:"));
  EXPECT_THAT(overviewOf(without("bad", record)),
              AllOf(HasSubstr("No false accept. succ.:"), Not(HasSubstr("bad"))));
  claimTooMuch(&record.results[0]);
  EXPECT_THAT(overviewOf(record),
              HasSubstr("False accepts: 2, for example by good (1): V1 at 0.1 s: velocity.\n"));
  claimTooMuch(&record.results[4]);
  EXPECT_THAT(
      overviewOf(record),
      HasSubstr(
          "False accepts: 3, most by good (2): V1 at 0.1 s: velocity; V1 at 5.1 s: velocity.\n"));
  EXPECT_THAT(overviewOf(without("bad", record)),
              HasSubstr("False accepts: 2 (V1 at 0.1 s: velocity; V1 at 5.1 s: velocity).\n"));
  record = testing::exampleBenchmark();
  for (const size_t i : {3, 9}) claimTooMuch(&record.results[i]);
  EXPECT_THAT(overviewOf(record),
              HasSubstr("False accepts: 2, all by bad: V1 at 2.5 s: no success, velocity; V1 at "
                        "10.0 s: velocity.\n"));
}

TEST(BenchmarkOverview, SaysWhatTheGroundTruthsVelocityIsWorthInAFalseAccept) {
  BenchmarkRecord record = testing::exampleBenchmark();
  EXPECT_THAT(overviewOf(record), Not(HasSubstr("In brackets")));
  for (WindowResult& result : record.results)
    result.truth_check.velocity_step_mps = 0.004 + (result.window == 1 ? 0.05 : 0.0);
  EXPECT_THAT(overviewOf(record),
              HasSubstr("False accepts: 1 by bad: V1 at 2.5 s: no success [0.054 m/s].\n"
                        "In brackets: largest step of the ground truth's velocity that the "
                        "accelerometer did not feel (median\nof all windows: 0.004 m/s).\n"));
}

TEST(BenchmarkOverview, OfManyFalseAcceptsItListsThreeInLinesThatFitAScreen) {
  BenchmarkRecord record;
  for (int window = 0; window < 8; ++window)
    for (const char* initializer : {"orbslam3_inertial_only", "other"}) {
      WindowResult result =
          testing::exampleResult("V1_03_difficult", 100 * window, initializer, {true, true, 1.0});
      if (initializer[1] == 'r' || window == 0) {
        claimTooMuch(&result);
        result.attempt.stages.back().errors->tilt_nees = 9.0;
        result.attempt.stages.back().errors->accel_bias_nees = 9.0;
      }
      record.results.push_back(result);
    }
  const std::string text = overviewOf(record);
  EXPECT_THAT(text, HasSubstr("False accepts: 9, most by orbslam3_inertial_only (8): "
                              "V1_03_difficult at 0.0 s: tilt,\nvelocity, accelerometer bias; "));
  EXPECT_THAT(text, AllOf(HasSubstr("at 500.0 s: "), HasSubstr("; ...."), Not(HasSubstr("750.0"))));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
}

TEST(BenchmarkOverview, FindsNoFalseAcceptWhereNothingIsJudged) {
  BenchmarkRecord record = testing::exampleBenchmark();
  for (WindowResult& result : record.results) result.truth.clear();
  EXPECT_THAT(overviewOf(record), AllOf(HasSubstr("None can be judged without ground truth."),
                                        Not(HasSubstr("alse accept"))));
}

TEST(BenchmarkOverview, ComparesWithTheFirst) {
  BenchmarkRecord record;
  for (int window = 10; window < 50; ++window)
    for (const auto& [name, gravity] :
         {std::pair("a", 1.0), std::pair("b", 1.1), std::pair("c", 1.0)})
      record.results.push_back(
          testing::exampleResult("V1", window, name, {true, true, gravity + 0.01 * (window % 7)}));
  std::vector<PairedComparison> comparisons;
  for (const char* other : {"b", "c"})
    for (const PairedComparison& c : comparePaired(record, "a", other, overviewFigures()))
      comparisons.push_back(c);
  const std::string text =
      toString(comparisonOverview(comparisons, BootstrapOptions()), TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("Compared with a, 10 keyframes at 4 Hz"));
  EXPECT_THAT(text, HasSubstr("b            =      worse  worse  worse  worse"));
  EXPECT_THAT(text, HasSubstr("c            =      =      =      =      ="));
  EXPECT_THAT(text, AllOf(HasSubstr("this one alone"), Not(HasSubstr("few"))));
}

TEST(BenchmarkOverview, SaysOnceThatPairsAreTooFew) {
  const auto comparisons =
      comparePaired(testing::exampleBenchmark(), "good", "bad", overviewFigures());
  const std::string text =
      toString(comparisonOverview(comparisons, BootstrapOptions()), TableFormat::kText);
  EXPECT_EQ(text.find("too few pairs"), text.rfind("too few pairs"));
  EXPECT_THAT(text, HasSubstr("too few pairs"));
}

TEST(BenchmarkOverview, TheGlossaryFitsALine) {
  std::istringstream text(glossary());
  for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 100u) << line;
}

}  // namespace
}  // namespace etalon
