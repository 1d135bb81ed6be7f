#include "report_data.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "etalon/core/so3.h"
#include "etalon/evaluation/window_metrics.h"
#include "etalon/testing/example_benchmark.h"
#include "report_page.h"

namespace etalon {
namespace {

using nlohmann::json;

TEST(ScriptText, CannotEndTheElementItStandsIn) {
  EXPECT_EQ(scriptText(json("</script><!--")), "\"\\u003c/script>\\u003c!--\"");
  EXPECT_EQ(json::parse(scriptText(json("a < b"))), "a < b");
  EXPECT_EQ(scriptText(json("\xFF")), "\"\xEF\xBF\xBD\"");  // no valid UTF-8
}

TEST(PageText, KeepsLinesAndShowsWhatActsUnseen) {
  EXPECT_EQ(pageText("two\nlines\tand \xC3\xA9"), "two\nlines\tand \xC3\xA9");
  EXPECT_EQ(pageText("\x1b[31mred\x7f"), "\\x1b[31mred\\x7f");
  EXPECT_EQ(pageText("\xE2\x80\xAEright to left"), "\\u202eright to left");
  EXPECT_EQ(pageText("broken \xC3"), "broken \xEF\xBF\xBD");
}

TEST(ReportData, TextsStandOnceAndResultsReferToThem) {
  const json data = reportData(testing::exampleBenchmark());
  EXPECT_EQ(data.at("sequence_names"), json({"V1", "none"}));
  EXPECT_EQ(data.at("initializer_names"), json({"good", "bad"}));
  EXPECT_EQ(data.at("shapes"), json::parse("[[10, 4.0]]"));
  const json& statuses = data.at("statuses");
  EXPECT_EQ(std::set<json>(statuses.begin(), statuses.end()).size(), statuses.size());
  for (const json& result : data.at("results")) {
    EXPECT_LT(result[5].get<size_t>(), statuses.size());
    EXPECT_LT(result[6].get<size_t>(), data.at("reasons").size());
    EXPECT_LT(result[7].get<size_t>(), data.at("frames").size());
  }
}

TEST(ReportData, WindowsThatGrewToOtherLengthsHaveKeyframesOfTheirOwn) {
  BenchmarkRecord record = testing::exampleBenchmark();
  for (WindowResult& result : record.results)
    for (const StampedState& state : result.truth) result.attempt.keyframes.push_back(state.t);
  // "good" was accepted with three keyframes in the first window, "bad" with all of them.
  record.results[0].attempt.keyframes.resize(3);
  record.results[0].truth.resize(3);
  const json data = reportData(record);
  const auto frame = [&](size_t i) {
    return data.at("frames").at(data.at("results").at(i).at(7).get<size_t>());
  };
  EXPECT_EQ(frame(0).at(0).size(), 3U);
  EXPECT_EQ(frame(1).at(0).size(), 10U);
  EXPECT_EQ(frame(1).at(1).size(), 30U);
  EXPECT_EQ(data.at("results").at(2).at(7), data.at("results").at(3).at(7));  // the same window
}

TEST(ReportData, LimitsAreThoseOfSuccess) {
  int limits = 0;
  const json data = reportData(testing::exampleBenchmark());
  for (const json& metric : data.at("metrics")) {
    if (metric.at("limit").is_null()) continue;
    ++limits;
    EXPECT_EQ(metric.at("limit"),
              metric.at("key") == "gravity_deg" ? kSuccessGravityDeg : kSuccessVelocityMps);
  }
  EXPECT_EQ(limits, 2);
}

TEST(ReportData, SuccessIsJudgedPerStageAndNotWithoutGroundTruth) {
  const json data = reportData(testing::exampleBenchmark());
  const auto judged = [&](size_t i) { return data.at("results").at(i).at(8); };
  EXPECT_EQ(judged(0), json({1, 1}));               // good, window 0: 1 deg
  EXPECT_EQ(judged(3), json({0, 0}));               // bad, window 1: 6 deg, 3 deg after VI-BA
  EXPECT_EQ(judged(4), json({0, 1}));               // good, window 2: 3 deg, 1.5 deg after
  EXPECT_EQ(judged(5), json({0, 0}));               // bad refused
  EXPECT_EQ(judged(10), json({nullptr, nullptr}));  // no ground truth
}

TEST(ReportData, SaysWhatOfAnAcceptedEstimateIsOutsideItsClaim) {
  BenchmarkRecord record = testing::exampleBenchmark();
  const auto outside = [&record](size_t i) {
    const json data = reportData(record);
    const json& index = data.at("results").at(i).at(12);
    return index.is_null() ? index : data.at("reasons").at(index.get<size_t>());
  };
  WindowErrors& errors = *record.results[0].attempt.stages[1].errors;
  EXPECT_EQ(outside(0), "");
  errors.tilt_nees = errors.velocity_nees = 100.0;
  EXPECT_EQ(outside(0), "tilt, velocity");
  record.results[0].attempt.status = "diverged";
  EXPECT_EQ(outside(0), nullptr);
  EXPECT_EQ(outside(10), nullptr);  // no ground truth
  // Without VI-BA it is the initializer's own estimate that is accepted.
  record.results[0].attempt.status = kStatusSuccess;
  record.protocol.vi_ba = false;
  EXPECT_EQ(outside(0), "");
}

}  // namespace
}  // namespace etalon
