#include "etalon/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "etalon/testing/example_benchmark.h"
#include "page_data.h"
#include "report_assets.h"
#include "report_data.h"
#include "report_example.h"

namespace etalon {
namespace {

using nlohmann::json;
using testing::dataOf;
using ::testing::HasSubstr;
using ::testing::Not;

size_t countOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

bool isUtf8(const std::string& text) {
  try {
    return !json(text).dump().empty();
  } catch (const json::exception&) {
    return false;
  }
}

testing::ReportExampleSize smallExample() { return {7, 8, 3, {10}, {4.0}}; }

TEST(Report, HoldsEveryWindowWithStatusReasonAndStages) {
  const BenchmarkRecord record = testing::reportExample(smallExample());
  const json data = dataOf(benchmarkReportHtml(record));
  ASSERT_EQ(data.at("results").size(), record.results.size());
  size_t refused = 0;
  for (size_t i = 0; i < record.results.size(); ++i) {
    const WindowResult& result = record.results[i];
    const json& packed = data.at("results").at(i);
    EXPECT_EQ(data.at("sequence_names").at(packed[0].get<size_t>()), result.sequence);
    EXPECT_EQ(data.at("shapes").at(packed[1].get<size_t>()).at(0), result.keyframes);
    EXPECT_EQ(packed[2], result.window);
    EXPECT_EQ(packed[3], 2.5 * result.window);
    EXPECT_EQ(data.at("initializer_names").at(packed[4].get<size_t>()), result.initializer);
    EXPECT_EQ(data.at("statuses").at(packed[5].get<size_t>()), result.attempt.status);
    EXPECT_EQ(data.at("reasons").at(packed[6].get<size_t>()), result.attempt.reason);
    EXPECT_EQ(packed[10][0].is_null(), result.attempt.stage(kStageInit) == nullptr);
    if (packed[10][0].is_null()) ++refused;
  }
  EXPECT_GT(refused, 0U);
  EXPECT_LT(refused, record.results.size());
  EXPECT_EQ(data.at("sequences").size(), 7U);
  EXPECT_THAT(data.at("sequences").at(6).at("error").get<std::string>(), HasSubstr("expected"));
}

TEST(Report, PositionsAreAlignedWithGroundTruthAndCountFromItsFirstKeyframe) {
  const BenchmarkRecord record = testing::reportExample(smallExample());
  const json data = reportData(record);
  for (size_t i = 0; i < record.results.size(); ++i) {
    const WindowResult& result = record.results[i];
    const json& vi_ba = data.at("results").at(i)[10][1];
    if (result.truth.empty() || vi_ba.is_null()) continue;
    const json& truth = data.at("frames").at(data.at("results").at(i)[7].get<size_t>())[1];
    ASSERT_EQ(truth.size(), 30U);
    ASSERT_EQ(vi_ba[1].size(), 30U);
    EXPECT_EQ(truth[0], 0);
    const Eigen::Vector3d step = result.truth[9].T_WB.t - result.truth[0].T_WB.t;
    for (size_t d = 0; d < 3; ++d) {
      EXPECT_NEAR(truth[27 + d].get<double>() * 1e-5, step[d], 1e-5);
      // The example's estimates are up to 0.4 * 0.01 * 18 m off (1 sigma), in a world of their own
      // that is metres away.
      EXPECT_NEAR(vi_ba[1][27 + d].get<double>(), truth[27 + d].get<double>(), 0.5e5);
    }
  }
}

TEST(Report, WithoutGroundTruthTheStagesAreAlignedWithEachOther) {
  testing::ReportExampleSize size = smallExample();
  const BenchmarkRecord record = testing::reportExample(size);
  const json data = reportData(record);
  size_t seen = 0;
  for (size_t i = 0; i < record.results.size(); ++i) {
    if (record.results[i].sequence != "no_ground_truth") continue;
    const json& packed = data.at("results").at(i);
    if (packed[10][1].is_null()) continue;
    ++seen;
    EXPECT_TRUE(data.at("frames").at(packed[7].get<size_t>())[1].is_null());
    EXPECT_EQ(packed[10][1][1][0], 0);
    EXPECT_TRUE(packed[8][0].is_null()) << "cannot be judged";
    EXPECT_TRUE(packed[10][1][0][0].is_null()) << "no error";
  }
  EXPECT_GT(seen, 0U);
}

TEST(Report, NotANumberIsNullAndAnEstimateAtInfinityIsNotDrawn) {
  BenchmarkRecord record = testing::exampleBenchmark();
  StageRecord& stage = record.results[0].attempt.stages[0];
  stage.errors->ate_m = std::numeric_limits<double>::infinity();
  stage.errors->rre_deg = WindowErrors::kNone;
  StampedState state;
  state.T_WB.t.x() = WindowErrors::kNone;
  stage.states = {state};
  const json data = dataOf(benchmarkReportHtml(record));
  const json& packed = data.at("results").at(0)[10][0];
  EXPECT_TRUE(packed[0][0].is_null());
  EXPECT_TRUE(packed[0][1].is_null());
  EXPECT_DOUBLE_EQ(packed[0][3].get<double>(), 1.0);  // gravity
  EXPECT_TRUE(packed[1].is_null());
}

TEST(Report, HostileTextsStayTexts) {
  const std::string hostile =
      "</script><script>alert(1)</script><!-- \" ' & {{data}} \xFF\xFE \x01 <b>";
  BenchmarkRecord record = testing::exampleBenchmark();
  record.initializers[0].name = record.initializers[0].description = hostile;
  record.sequences[0].name = record.sequences[0].error = hostile;
  record.sequences[1].warnings = {hostile};
  record.versions = {{hostile, hostile}};
  record.config = hostile;
  for (WindowResult& result : record.results) {
    if (result.sequence == "V1") result.sequence = hostile;
    if (result.initializer == "good") result.initializer = hostile;
    result.attempt.status = result.attempt.reason = hostile;
    result.attempt.timings.push_back({hostile, 1.0});
  }
  const std::string html = benchmarkReportHtml(record);
  EXPECT_TRUE(isUtf8(html));
  const std::string harmless = benchmarkReportHtml(testing::exampleBenchmark());
  EXPECT_EQ(countOf(html, "<script"), countOf(harmless, "<script"));
  EXPECT_EQ(countOf(html, "</script"), countOf(harmless, "</script"));
  EXPECT_EQ(countOf(html, "id=\"data\""), 1U);
  EXPECT_THAT(html, Not(HasSubstr("<!-- \"")));
  EXPECT_THAT(html, Not(HasSubstr(std::string(1, '\x01'))));
  const json data = dataOf(html);
  EXPECT_THAT(data.at("reasons").at(0).get<std::string>(),
              HasSubstr("</script><script>alert(1)</script><!-- \" ' & {{data}} "));
}

TEST(Report, NeedsNothingElseAndCarriesTheLicences) {
  const std::string html = benchmarkReportHtml(testing::exampleBenchmark());
  EXPECT_THAT(html, HasSubstr(std::string(report_assets::library())));
  EXPECT_THAT(html, HasSubstr("Apache License"));
  EXPECT_THAT(html, HasSubstr("The Apache Software Foundation"));
  EXPECT_THAT(html, HasSubstr("Baidu"));    // zrender
  EXPECT_THAT(html, HasSubstr("Bostock"));  // d3
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  EXPECT_EQ(countOf(html, "<script"), 3U);  // data, library, the page's own
  EXPECT_THAT(html, Not(HasSubstr("<script src")));
  EXPECT_THAT(html, Not(HasSubstr("<link rel=\"stylesheet")));
  EXPECT_THAT(html, Not(HasSubstr("{{"))) << "a placeholder was left";
}

TEST(Report, StaysSmallEnoughForAWholeBenchmark) {
  const BenchmarkRecord record = testing::reportExample({});
  ASSERT_EQ(record.results.size(), 6U * 60 * 7 * 4);
  const std::string html = benchmarkReportHtml(record);
  // 7 sequences shall stay below 25 MB; these are 6, and some windows have no stages.
  EXPECT_LT(html.size(), 20'000'000U);
}

TEST(Report, IsTheSameEveryTime) {
  const BenchmarkRecord record = testing::reportExample(smallExample());
  EXPECT_EQ(benchmarkReportHtml(record), benchmarkReportHtml(record));
}

TEST(Report, OfAnEmptyBenchmarkIsAPage) {
  const std::string html = benchmarkReportHtml({});
  EXPECT_TRUE(dataOf(html).at("results").empty());
  EXPECT_THAT(html, HasSubstr("</html>"));
}

}  // namespace
}  // namespace etalon
