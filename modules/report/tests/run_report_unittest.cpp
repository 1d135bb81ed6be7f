#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "etalon/core/so3.h"
#include "etalon/report/report.h"
#include "page_data.h"
#include "report_example.h"

namespace etalon {
namespace {

using nlohmann::json;
using testing::dataOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Columns of a row, as page/run.js has them.
constexpr size_t kTime = 0, kState = 1, kPosition = 2, kTruth = 5, kFigures = 8;

size_t columnOf(const json& data, const std::string& key) {
  for (size_t k = 0; k < data.at("figures").size(); ++k)
    if (data.at("figures").at(k).at("key") == key) return kFigures + 2 * k;
  ADD_FAILURE() << "no figure " << key;
  return 0;
}

TEST(RunReport, HoldsStatesAndErrorsBesideThePredictedOnes) {
  const testing::RunExample run = testing::runExample();
  const json data = dataOf(runReportHtml(run.record, run.estimates, run.ground_truth));
  ASSERT_EQ(data.at("rows").size(), run.estimates.size());
  const json& row = data.at("rows").at(400);
  ASSERT_EQ(row.size(), kFigures + 2 * data.at("figures").size());
  EXPECT_EQ(row[kTime], 20.0);
  EXPECT_EQ(data.at("states").at(row[kState].get<size_t>()), "dead_reckoning");
  // The whole flight is aligned: its errors are at most 14 cm, unaligned it is metres off.
  for (size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(row[kPosition + i].get<double>(), row[kTruth + i].get<double>(), 0.15);
  // The example's error is 2 / sqrt(3) standard deviations of an axis, predicted are sqrt(3).
  const double sigma = 1e-4 * (400 - data.at("initialized_at_s").get<double>() / 0.05);
  const size_t position = columnOf(data, "position"), velocity = columnOf(data, "velocity");
  EXPECT_NEAR(row[position].get<double>(), 2.0 / std::sqrt(3.0) * sigma, 1e-6);
  EXPECT_NEAR(row[position + 1].get<double>(), std::sqrt(3.0) * sigma, 1e-6);
  EXPECT_NEAR(row[velocity].get<double>(), 0.01, 1e-6);
  EXPECT_NEAR(row[velocity + 1].get<double>(), 0.03, 1e-6);
  EXPECT_NEAR(row[columnOf(data, "tilt")].get<double>(), 0.0, 1e-5);
  EXPECT_NEAR(row[columnOf(data, "gyro_bias")].get<double>(), 0.0, 1e-9);
}

TEST(RunReport, BeforeTheStartNothingIsPredicted) {
  const testing::RunExample run = testing::runExample();
  const json data = dataOf(runReportHtml(run.record, run.estimates, run.ground_truth));
  const json& row = data.at("rows").at(3);
  for (size_t column = kFigures; column < row.size(); ++column)
    EXPECT_TRUE(row[column].is_null()) << column;
  EXPECT_EQ(data.at("states").at(row[kState].get<size_t>()), "visual");
}

TEST(RunReport, ARotationIsTiltAndYawInTheWorld) {
  testing::RunExample run = testing::runExample();
  // The last frame is turned by 1 deg about the world's x, then by 2 deg about its z.
  FrameEstimate& last = run.estimates.back();
  const double deg = std::acos(-1.0) / 180.0;
  last.nav.T_WB.R = expSO3({0, 0, 2 * deg}) * expSO3({deg, 0, 0}) * last.nav.T_WB.R;
  const json data = dataOf(runReportHtml(run.record, run.estimates, run.ground_truth));
  const json& row = data.at("rows").back();
  EXPECT_NEAR(row[columnOf(data, "tilt")].get<double>(), 1.0, 1e-3);
  EXPECT_NEAR(row[columnOf(data, "yaw")].get<double>(), 2.0, 1e-3);
}

TEST(RunReport, TellsEventsStagesAndAttempts) {
  testing::RunExample run = testing::runExample();
  EXPECT_THAT(runReportHtml(run.record, run.estimates, run.ground_truth),
              Not(HasSubstr("Calibration")));
  run.record.calibration = {
      {"extrinsics", "baseline", "%", "not_observed", "none <said>", {}, {}, {}}};
  const std::string html = runReportHtml(run.record, run.estimates, run.ground_truth);
  EXPECT_THAT(html, HasSubstr("none &lt;said&gt;"));
  EXPECT_THAT(html, HasSubstr("not observed"));
  EXPECT_THAT(html, HasSubstr("no image &lt;came&gt;"));
  EXPECT_THAT(html, Not(HasSubstr("no image <came>")));
  EXPECT_THAT(html, HasSubstr("still inertial"));
  EXPECT_THAT(html, HasSubstr("front end"));
  EXPECT_THAT(html, HasSubstr("error over predicted"));
  const json data = dataOf(html);
  ASSERT_EQ(data.at("events").size(), run.record.events.size());
  EXPECT_EQ(data.at("events").at(2).at("t"), 20.0);
  EXPECT_EQ(data.at("events").at(4).at("remark"), true);
}

TEST(RunReport, WithoutGroundTruthOrAttempts) {
  testing::RunExample run = testing::runExample();
  const json blind = dataOf(runReportHtml(run.record, run.estimates, {}));
  const json& row = blind.at("rows").back();
  for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(row[kTruth + i].is_null());
  const size_t position = columnOf(blind, "position");
  EXPECT_TRUE(row[position].is_null());
  EXPECT_GT(row[position + 1].get<double>(), 0.1);  // a prediction needs no ground truth
  run.record.attempts.clear();
  run.record.events.clear();
  run.record.initialized_at.reset();
  const std::string html = runReportHtml(run.record, {}, {});
  EXPECT_TRUE(dataOf(html).at("rows").empty());
  EXPECT_THAT(html, HasSubstr("<dt>Initialized</dt><dd>never</dd>"));
}

TEST(RunReport, TruthWithoutVelocitiesOrBiasesJudgesNone) {
  testing::RunExample run = testing::runExample();
  run.ground_truth.has_velocity = run.ground_truth.has_biases = false;
  const json data = dataOf(runReportHtml(run.record, run.estimates, run.ground_truth));
  const json& row = data.at("rows").back();
  for (const char* key : {"velocity", "gyro_bias", "accel_bias"})
    EXPECT_TRUE(row[columnOf(data, key)].is_null()) << key;
  EXPECT_FALSE(row[columnOf(data, "position")].is_null());
}

TEST(RunReport, ALongFlightIsThinnedAndWhatIsNowhereIsLeftOut) {
  std::vector<FrameEstimate> estimates(10'000);
  for (size_t i = 0; i < estimates.size(); ++i)
    estimates[i].t = 50'000'000LL * static_cast<TimeNs>(i);
  EXPECT_EQ(dataOf(runReportHtml({}, estimates, {})).at("rows").size(), 2500U);
  estimates.resize(10);
  estimates[3].nav.T_WB.t.x() = std::numeric_limits<double>::quiet_NaN();
  estimates[4].nav.T_WB.t.x() = 1e12;
  EXPECT_EQ(dataOf(runReportHtml({}, estimates, {})).at("rows").size(), 8U);
}

}  // namespace
}  // namespace etalon
