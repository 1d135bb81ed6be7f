#include "etalon/benchmark/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using testing::exampleBenchmark;
using testing::exampleResult;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(WindowRow, OfAnAcceptedResultBothStagesSucceed) {
  const WindowResult result = exampleResult("V1", 3, "eta", {true, true, 1.5});
  const WindowRow init = windowRow(result, kStageInit), vi_ba = windowRow(result, kStageViBa);
  EXPECT_EQ(init.sequence, "V1");
  EXPECT_EQ(init.window, 3);
  EXPECT_EQ(init.t0, 7'500'000'000);
  EXPECT_EQ(init.keyframes, 10);
  EXPECT_EQ(init.initializer, "eta");
  EXPECT_EQ(init.status, kStatusSuccess);
  EXPECT_EQ(init.reason, "");
  EXPECT_DOUBLE_EQ(init.errors.gravity_deg, 1.5);
  EXPECT_EQ(init.runtime_ms, 2.0);  // without stereo odometry's 13 ms
  EXPECT_EQ(vi_ba.status, kStatusSuccess);
  EXPECT_EQ(vi_ba.runtime_ms, 20.0);
  EXPECT_LT(vi_ba.errors.gravity_deg, init.errors.gravity_deg);
}

TEST(WindowRow, AnEstimateThatWasNotAcceptedKeepsItsErrors) {
  const WindowResult result = exampleResult("V1", 0, "eta", {true, false, 1.5});
  const WindowRow init = windowRow(result, kStageInit), vi_ba = windowRow(result, kStageViBa);
  EXPECT_EQ(init.status, kStatusSuccess);  // the initializer has done its part
  EXPECT_EQ(init.reason, "");
  EXPECT_NE(vi_ba.status, kStatusSuccess);
  EXPECT_EQ(vi_ba.status, result.attempt.status);
  EXPECT_EQ(vi_ba.reason, result.attempt.reason);
  EXPECT_TRUE(std::isfinite(vi_ba.errors.gravity_deg));
  EXPECT_EQ(vi_ba.success(), false);  // however small its errors are
}

TEST(WindowRow, ARefusalStandsInBothStagesWithItsReason) {
  const WindowResult result = exampleResult("V1", 0, "eta", {false, false, 0.0});
  for (const char* stage : {kStageInit, kStageViBa}) {
    const WindowRow row = windowRow(result, stage);
    EXPECT_EQ(row.status, result.attempt.status);
    EXPECT_EQ(row.reason, result.attempt.reason);
    EXPECT_NE(row.status, kStatusSuccess);
    EXPECT_TRUE(std::isnan(row.errors.gravity_deg));
    EXPECT_EQ(row.success(), false);
  }
}

TEST(WindowRow, SuccessHasTwoLimitsAndNeedsGroundTruth) {
  WindowRow row;
  row.status = kStatusSuccess;
  EXPECT_FALSE(row.success().has_value());  // no ground truth: unknown, not a failure
  row.errors.gravity_deg = 1.99;
  EXPECT_FALSE(row.success().has_value());  // no velocity
  row.errors.velocity_mps = 0.099;
  EXPECT_EQ(row.success(), true);
  row.errors.velocity_mps = 0.1;
  EXPECT_EQ(row.success(), false);
  row.errors.velocity_mps = 0.0;
  row.errors.gravity_deg = 2.0;
  EXPECT_EQ(row.success(), false);
}

TEST(WindowRows, AFalseAcceptIsAcceptedAndWrongOrOutsideOfItsClaim) {
  WindowRow row;
  row.errors.gravity_deg = 3.0;
  row.errors.velocity_mps = 0.01;
  row.status = "not_converged";
  EXPECT_EQ(row.falseAccept(), false);  // it was refused
  row.status = kStatusSuccess;
  EXPECT_EQ(row.falseAccept(), true);
  EXPECT_EQ(row.falseAcceptReason(), "no success");
  row.errors.gravity_deg = 1.0;
  EXPECT_EQ(row.falseAccept(), false);
  EXPECT_EQ(row.falseAcceptReason(), "");
  row.errors.tilt_nees = 8.0;
  EXPECT_EQ(row.falseAccept(), true);
  EXPECT_EQ(row.falseAcceptReason(), "tilt");
  row.errors.velocity_mps = 0.1;
  row.errors.velocity_nees = 6.0;
  EXPECT_EQ(row.falseAcceptReason(), "no success, tilt, velocity");
  row.errors = WindowErrors();
  EXPECT_FALSE(row.falseAccept().has_value());  // no ground truth
  EXPECT_FALSE(row.falseAcceptReason().has_value());
}

TEST(WindowRows, InitStandsBeforeViBaWhichIsThereIfItWasAskedFor) {
  BenchmarkRecord record = exampleBenchmark();
  std::vector<WindowRow> rows = windowRows(record);
  ASSERT_EQ(rows.size(), 2 * record.results.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].stage, i % 2 == 0 ? kStageInit : kStageViBa);
    EXPECT_EQ(rows[i].initializer, record.results[i / 2].initializer);
  }
  record.protocol.vi_ba = false;
  rows = windowRows(record);
  ASSERT_EQ(rows.size(), record.results.size());
  EXPECT_EQ(rows.back().stage, kStageInit);
}

TEST(WindowsCsv, QuotesTextsAndLeavesUnknownNumbersEmpty) {
  WindowRow row;
  row.sequence = "a,b";
  row.window = 7;
  row.t0 = 123;
  row.keyframes = 10;
  row.rate_hz = 2.5;
  row.initializer = "eta";
  row.stage = kStageInit;
  row.status = "too_few_tracks";
  row.reason = "12 \"landmarks\", at least 30";
  row.window_s = 2.25;
  row.runtime_ms = 0.125;
  const std::string csv = windowsCsv({row});
  EXPECT_THAT(csv, StartsWith("sequence,window,t0_ns,keyframes,rate_hz,initializer,stage,status,"
                              "reason,rre_deg,ate_m,"));
  EXPECT_THAT(csv, HasSubstr("\n\"a,b\",7,123,10,2.5,eta,init,too_few_tracks,"
                             "\"12 \"\"landmarks\"\", at least 30\",,,,,,,,,,,,2.25,0.125\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2);
}

TEST(WindowShape, IsLengthAndRate) {
  EXPECT_EQ((WindowShape{10, 4.0}), WindowShape());
  EXPECT_NE((WindowShape{10, 4.0}), (WindowShape{10, 5.0}));
  EXPECT_NE((WindowShape{10, 4.0}), (WindowShape{9, 4.0}));
  EXPECT_EQ(exampleResult("V1", 0, "eta", {true, true, 1.0}).shape(), (WindowShape{10, 4.0}));
}

}  // namespace
}  // namespace etalon
