#include "etalon/benchmark/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/evaluation/window_metrics.h"
#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using testing::exampleBenchmark;
using testing::exampleResult;
using ::testing::HasSubstr;
using ::testing::StartsWith;

SummaryRow find(const std::vector<SummaryRow>& rows, const std::string& sequence,
                const std::string& initializer, const std::string& stage,
                const std::string& which = kAllWindows) {
  for (const SummaryRow& row : rows)
    if (row.sequence == sequence && row.initializer == initializer && row.stage == stage &&
        row.which == which)
      return row;
  ADD_FAILURE() << "no row " << sequence << " " << initializer << " " << stage << " " << which;
  return {};
}

size_t indexOf(const std::string& key) {
  const std::vector<WindowMetric> metrics = windowMetrics();
  for (size_t m = 0; m < metrics.size(); ++m)
    if (metrics[m].key == key) return m;
  return metrics.size();
}

TEST(Summary, CountsByHand) {
  const std::vector<SummaryRow> rows = summarize(exampleBenchmark());
  // (V1, none, all) x (good, bad) x (init, vi_ba) x (all, moving)
  EXPECT_EQ(rows.size(), 3u * 2 * 2 * 2);
  const SummaryRow good = find(rows, "V1", "good", kStageInit);
  EXPECT_EQ(good.count, 5);
  EXPECT_EQ(good.judged, 5);
  EXPECT_EQ(good.estimates, 5);
  EXPECT_EQ(good.refusals, 0);
  EXPECT_EQ(good.successes, 3);  // 1, 1.5, 0.5 deg; 2 deg is not less than 2
  EXPECT_DOUBLE_EQ(good.success_rate, 0.6);

  const SummaryRow bad = find(rows, "V1", "bad", kStageInit);
  EXPECT_EQ(bad.estimates, 4);
  EXPECT_EQ(bad.refusals, 1);
  EXPECT_EQ(bad.accepted, 4);
  EXPECT_EQ(bad.judged, 5);  // the refused one as well
  EXPECT_EQ(bad.successes, 1);

  const SummaryRow bad_vi_ba = find(rows, "V1", "bad", kStageViBa);
  EXPECT_EQ(bad_vi_ba.estimates, 4);  // one of them was not accepted
  EXPECT_EQ(bad_vi_ba.refusals, 1);
  EXPECT_EQ(bad_vi_ba.accepted, 3);
  EXPECT_EQ(bad_vi_ba.good_estimates, 2);
  EXPECT_EQ(bad_vi_ba.successes, 2);  // 1 and 0.75 deg; 3 deg is too much, 2.5 was refused
}

TEST(Summary, WithoutGroundTruthSuccessIsUnknownRefusedOrNot) {
  const std::vector<SummaryRow> rows = summarize(exampleBenchmark());
  for (const char* initializer : {"good", "bad"}) {
    const SummaryRow none = find(rows, "none", initializer, kStageViBa);
    EXPECT_EQ(none.count, 1);
    EXPECT_EQ(none.judged, 0);
    EXPECT_EQ(none.unknown, 1);
    EXPECT_TRUE(std::isnan(none.success_rate));
    const SummaryRow all = find(rows, kAllSequences, initializer, kStageViBa);
    EXPECT_EQ(all.count, 6);
    EXPECT_EQ(all.judged, 5);
    EXPECT_EQ(all.unknown, 1);
  }
  EXPECT_EQ(find(rows, "none", "bad", kStageInit).refusals, 1);
}

TEST(Summary, PosesAloneDoNotAllowToJudge) {
  BenchmarkRecord record = exampleBenchmark();
  for (WindowResult& result : record.results) {
    for (StampedState& state : result.truth) state.v_WB.setZero();
    for (StageRecord& stage : result.attempt.stages)
      if (stage.errors) stage.errors->velocity_mps = WindowErrors::kNone;
  }
  for (const SummaryRow& row : summarize(record)) EXPECT_EQ(row.judged, 0);
}

TEST(Summary, AWindowWithTooLittleGroundTruthIsUnknownWhateverCameOfIt) {
  BenchmarkRecord record = exampleBenchmark();
  for (WindowResult& result : record.results)
    for (const StampedState& state : result.truth) result.attempt.keyframes.push_back(state.t);
  // A window that `bad` refused has ground truth at its first four keyframes of ten.
  for (WindowResult& result : record.results)
    if (result.sequence == "V1" && result.window == 2) {
      result.truth.resize(4);
      for (StageRecord& stage : result.attempt.stages) {
        stage.states.resize(10);
        stage.errors->keyframes = 4;
      }
    }
  requireCoverage(&record);
  const std::vector<SummaryRow> rows = summarize(record);
  for (const char* initializer : {"good", "bad"})
    for (const char* stage : {kStageInit, kStageViBa}) {
      EXPECT_EQ(find(rows, "V1", initializer, stage).judged, 4);
      EXPECT_EQ(find(rows, "V1", initializer, stage).unknown, 1);
    }
  record.protocol.min_coverage = 0.4;
  EXPECT_EQ(find(summarize(record), "V1", "bad", kStageInit).judged, 5);
}

TEST(Summary, MeanMedianAndNinetiethPercentileByHand) {
  const std::vector<SummaryRow> rows = summarize(exampleBenchmark());
  const size_t gravity = indexOf("gravity_deg"), ate = indexOf("ate_m");
  const SummaryRow good = find(rows, "V1", "good", kStageInit);
  EXPECT_EQ(good.errors[gravity].count, 5);
  EXPECT_DOUBLE_EQ(good.errors[gravity].mean, 1.6);  // 0.5 1 1.5 2 3
  EXPECT_DOUBLE_EQ(good.errors[gravity].median, 1.5);
  EXPECT_DOUBLE_EQ(good.errors[gravity].p90, 2.6);  // position 3.6: 2 + 0.6 * 1
  EXPECT_DOUBLE_EQ(good.errors[ate].median, 0.015);
  EXPECT_EQ(good.errors[indexOf("scale_error")].count, 0);
  EXPECT_TRUE(std::isnan(good.errors[indexOf("scale_error")].mean));

  const SummaryRow bad = find(rows, "V1", "bad", kStageViBa);
  // 1 3 2.5 0.75: an estimate that was not accepted keeps its errors.
  EXPECT_EQ(bad.errors[gravity].count, 4);
  EXPECT_DOUBLE_EQ(bad.errors[gravity].median, 1.75);
  EXPECT_DOUBLE_EQ(bad.runtime_ms.mean, 20.0);
  EXPECT_EQ(bad.runtime_ms.count, 4);
  EXPECT_DOUBLE_EQ(bad.stereo_odometry_ms.median, 12.0);  // 10 to 14
}

TEST(Summary, MovingWindowsAreThoseWithAPath) {
  const std::vector<SummaryRow> rows = summarize(exampleBenchmark());
  const SummaryRow moving = find(rows, "V1", "good", kStageInit, kMovingWindows);
  EXPECT_EQ(moving.count, 4);
  EXPECT_DOUBLE_EQ(moving.errors[indexOf("gravity_deg")].mean, 7.5 / 4);
  EXPECT_EQ(find(rows, "none", "good", kStageInit, kMovingWindows).count, 0);

  WindowResult result = exampleResult("V1", 0, "good", {});
  for (const double step_m : {0.0055, 0.0056}) {  // nine steps: 4.95 cm, 5.04 cm
    for (int k = 0; k < 10; ++k) result.truth[k].T_WB.t.x() = step_m * k;
    EXPECT_EQ(inMotion(result), step_m > 0.00555);
  }
}

TEST(Summary, EveryWindowHasItsRows) {
  BenchmarkRecord record = exampleBenchmark();
  const size_t results = record.results.size();
  for (size_t i = 0; i < results; ++i) {
    WindowResult result = record.results[i];
    result.rate_hz = 10.0;
    record.results.push_back(result);
  }
  EXPECT_THAT(shapesOf(record), ElementsAre(WindowShape{10, 4.0}, WindowShape{10, 10.0}));
  const std::vector<SummaryRow> rows = summarize(record);
  EXPECT_EQ(rows.size(), 48u);
  EXPECT_EQ(rows[0].rate_hz, 4.0);
  EXPECT_EQ(rows[24].rate_hz, 10.0);
  EXPECT_EQ(rows[24].count, rows[0].count);
}

TEST(Summary, TheGyrosBoundIsOfWindowsThatDoNotGrow) {
  BenchmarkRecord record = exampleBenchmark();
  const auto bound = [&] {
    return truthCheck(record, {10, 4.0}, "V1", &WindowTruthCheck::rre_deg);
  };
  EXPECT_EQ(bound().count, 5);
  EXPECT_NEAR(bound().median, 0.03, 1e-12);  // of 0.01 to 0.05; rounding alone
  record.protocol.min_keyframes = 3;
  EXPECT_EQ(bound().count, 0);
  EXPECT_TRUE(std::isnan(bound().median));
}

TEST(Summary, WithoutViBaThereIsOneStage) {
  BenchmarkRecord record = exampleBenchmark();
  record.protocol.vi_ba = false;
  for (const SummaryRow& row : summarize(record)) EXPECT_EQ(row.stage, kStageInit);
}

TEST(Summary, CsvKeepsRunTimesInTheLastColumns) {
  const std::string csv = summaryCsv(exampleBenchmark());
  EXPECT_THAT(csv, StartsWith("sequence,keyframes,rate_hz,initializer,stage,windows,count,judged,"
                              "unknown,estimates,refusals,accepted,successes,success_rate,"
                              "rre_deg_mean,rre_deg_median,rre_deg_p90,ate_m_mean,"));
  EXPECT_THAT(csv, HasSubstr("scale_error_p90,good_estimates,good_estimate_rate,tilt_nees_mean,"
                             "tilt_nees_median,tilt_nees_p90,velocity_nees_mean,"));
  EXPECT_THAT(csv, HasSubstr("accel_bias_nees_p90,false_accepts,window_s_mean,window_s_median,"
                             "window_s_p90,runtime_ms_mean,runtime_ms_median,"
                             "runtime_ms_p90,"
                             "stereo_odometry_ms_mean,stereo_odometry_ms_median,"
                             "stereo_odometry_ms_p90\n"));
  EXPECT_THAT(csv, HasSubstr("\nV1,10,4,good,init,all,5,5,0,5,0,5,3,0.6,0.16,0.15,0.26,0.016,"));
  // No scale, no NEES; position 3.6 of 10 to 14.
  EXPECT_THAT(csv, HasSubstr(",,,,3,0.6,,,,,,,,,,,,,2,,,,2,2,2,12,12,13.6\n"));
  EXPECT_EQ(summaryCsv(BenchmarkRecord()).find('\n'), summaryCsv(BenchmarkRecord()).size() - 1);
}

}  // namespace
}  // namespace etalon
