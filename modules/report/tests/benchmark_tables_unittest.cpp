#include "etalon/report/benchmark_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using testing::exampleBenchmark;
using ::testing::HasSubstr;
using ::testing::Not;

TitledTable find(const std::vector<TitledTable>& tables, const std::string& id) {
  for (const TitledTable& table : tables)
    if (table.id == id) return table;
  throw Error("no table " + id);
}

Table tableOf(const BenchmarkRecord& record, const std::string& id) {
  return find(benchmarkTables(record), id).table;
}

TEST(BenchmarkTables, ErrorsInThePapersLayout) {
  const TitledTable table = find(benchmarkTables(exampleBenchmark()), "rre_deg_median_10_4hz");
  EXPECT_EQ(table.title, "RRE [deg], median, 10 keyframes at 4 Hz");
  EXPECT_EQ(table.table.toString(TableFormat::kText),
            "          without VI-BA   with VI-BA      gyro alone\n"
            "sequence    good     bad    good     bad  lower bound\n"
            "--------  ------  ------  ------  ------  -----------\n"
            "V1        0.1500  0.3500  0.0750  0.1750       0.0300\n"
            "none           -       -       -       -            -\n"
            "--------  ------  ------  ------  ------  -----------\n"
            "all       0.1500  0.3500  0.0750  0.1750       0.0300\n");
  EXPECT_THAT(table.table.toString(TableFormat::kMarkdown),
              HasSubstr("| V1       |          **0.1500** |"));
}

TEST(BenchmarkTables, SayWhereTheGroundTruthIsTheGyroAndWhatItsOwnBiasIsWorth) {
  BenchmarkRecord record = exampleBenchmark();
  const std::string copied =
      "In V1 the ground truth's rotations are the smoothed gyro (from state "
      "to state they agree with it to 0.08 of its white noise)";
  EXPECT_THAT(find(benchmarkTables(record), "rre_deg_mean_10_4hz").note, HasSubstr(copied));
  EXPECT_DOUBLE_EQ(tableOf(record, "gyro_bias_rps_median_10_4hz").numberAt(0, "lower_bound"),
                   0.003);
  EXPECT_THAT(find(benchmarkTables(record), "gyro_bias_rps_mean_10_4hz").note,
              HasSubstr("judged on simulation"));
  EXPECT_EQ(tableOf(record, "ground_truth").numberAt(0, "truth_gyro_rms"), 0.57);
  record.sequences[0].gyro_agreement = {0.1, 2.8};  // corrected all the time
  EXPECT_THAT(find(benchmarkTables(record), "rre_deg_mean_10_4hz").note,
              Not(HasSubstr("smoothed gyro")));
}

TEST(BenchmarkTables, EveryErrorHasMeanMedianAndPercentile) {
  const BenchmarkRecord record = exampleBenchmark();
  std::set<std::string> ids;
  for (const TitledTable& table : benchmarkTables(record))
    EXPECT_TRUE(ids.insert(table.id).second) << table.id;
  for (const WindowMetric& metric : windowMetrics())
    for (const char* statistic : {"_mean_10_4hz", "_median_10_4hz", "_p90_10_4hz"})
      EXPECT_EQ(ids.count(metric.key + statistic), 1u) << metric.key;
  EXPECT_DOUBLE_EQ(tableOf(record, "gravity_deg_mean_10_4hz").numberAt(0, "good_init"), 1.6);
  EXPECT_DOUBLE_EQ(tableOf(record, "gravity_deg_mean_10_4hz").numberAt(0, "world_tilt_deg"), 0.25);
  EXPECT_DOUBLE_EQ(tableOf(record, "rre_deg_p90_10_4hz").numberAt(0, "lower_bound"), 0.046);
  EXPECT_DOUBLE_EQ(tableOf(record, "ate_m_p90_10_4hz").numberAt(0, "good_init"), 0.026);
}

TEST(BenchmarkTables, SuccessAndRefusals) {
  const BenchmarkRecord record = exampleBenchmark();
  const Table success = tableOf(record, "success_10_4hz");
  EXPECT_EQ(success.numberAt(0, "windows"), 5);
  EXPECT_EQ(success.numberAt(0, "good_init"), 0.6);
  EXPECT_EQ(success.numberAt(0, "bad_vi_ba"), 0.4);
  EXPECT_TRUE(std::isnan(success.numberAt(1, "good_init")));  // no ground truth
  EXPECT_EQ(success.numberAt(2, "windows"), 6);
  EXPECT_EQ(success.numberAt(2, "judged"), 5);
  EXPECT_THAT(find(benchmarkTables(record), "success_10_4hz").table.toString(TableFormat::kHtml),
              HasSubstr("<b>60.0</b>"));  // the greatest is best
  const Table refusals = tableOf(record, "refusals_10_4hz");
  EXPECT_EQ(refusals.numberAt(0, "bad_init"), 1);
  EXPECT_EQ(refusals.numberAt(0, "bad_vi_ba"), 2);
  EXPECT_EQ(refusals.numberAt(2, "bad_vi_ba"), 3);
}

TEST(BenchmarkTables, RunTimeByPart) {
  const Table parts = tableOf(exampleBenchmark(), "runtime_parts_10_4hz");
  ASSERT_EQ(parts.rowCount(), 10u);
  EXPECT_EQ(parts.textAt(0, "part"), "stereo odometry");
  EXPECT_EQ(parts.textAt(1, "part"), "initializer");
  EXPECT_EQ(parts.numberAt(1, "median_ms"), 2);
  EXPECT_EQ(parts.textAt(2, "part"), "VI-BA");
  EXPECT_EQ(parts.textAt(3, "part"), "initializer: map");
  EXPECT_EQ(parts.textAt(4, "part"), "all together");  // its own stages are not counted twice
  EXPECT_NEAR(parts.numberAt(4, "mean_ms"), 70.0 / 6 + 2.0 + 20.0, 1e-6);
}

TEST(BenchmarkTables, NoiseInWords) {
  EXPECT_EQ(noiseVerdict({400, 100}).words, "too small");
  EXPECT_EQ(noiseVerdict({400, 100}).factor, 2.0);
  EXPECT_EQ(noiseVerdict({120, 100}).words, "about right");
  EXPECT_EQ(noiseVerdict({70, 100}).words, "about right");
  EXPECT_EQ(noiseVerdict({25, 100}).words, "too large");
  EXPECT_EQ(noiseVerdict({0, 0}).words, "");
  EXPECT_TRUE(std::isnan(noiseVerdict({0, 0}).factor));

  BenchmarkRecord record = exampleBenchmark();
  const Table noise = tableOf(record, "noise_10_4hz");
  EXPECT_EQ(noise.numberAt(0, "windows"), 5);  // of the first initializer alone
  EXPECT_EQ(noise.numberAt(0, "gyro_chi2_per_dof"), 4);
  EXPECT_EQ(noise.textAt(0, "gyro_noise"), "too small");
  EXPECT_EQ(noise.numberAt(0, "gyro_factor"), 2);
  EXPECT_EQ(noise.textAt(0, "accel_noise"), "too large");
  EXPECT_EQ(noise.textAt(0, "vision_noise"), "about right");
  EXPECT_EQ(noise.numberAt(2, "windows"), 6);
  for (WindowResult& result : record.results) result.noise.reset();
  EXPECT_THROW(find(benchmarkTables(record), "noise_10_4hz"), Error);
}

TEST(BenchmarkTables, BoundOfEverySequence) {
  BenchmarkRecord record = exampleBenchmark();
  const Table checks = tableOf(record, "ground_truth");
  ASSERT_EQ(checks.rowCount(), 2u);
  EXPECT_EQ(checks.numberAt(0, "rre_deg"), 0.0333);
  EXPECT_EQ(checks.numberAt(0, "gyro_bias_rps"), 0.08);
  EXPECT_EQ(checks.textAt(1, "ground_truth"), "none");
  EXPECT_TRUE(std::isnan(checks.numberAt(1, "rre_deg")));
  const auto text = [&] {
    return find(benchmarkTables(record), "ground_truth").table.toString(TableFormat::kText);
  };
  EXPECT_THAT(text(), Not(HasSubstr("problem")));
  record.sequences[1].error = "cam0/data.csv: no such file";
  EXPECT_THAT(text(), HasSubstr("cam0/data.csv: no such file"));
}

TEST(BenchmarkTables, OneSetAWindow) {
  BenchmarkRecord record = exampleBenchmark();
  const size_t one = benchmarkTables(record).size();
  WindowResult result = record.results.front();
  result.keyframes = 5;
  result.rate_hz = 10.0;
  record.results.push_back(result);
  const std::vector<TitledTable> two = benchmarkTables(record);
  EXPECT_EQ(two.size(), 2 * one - 1);  // the ground truth once
  EXPECT_EQ(find(two, "success_5_10hz").title, "Success [%], 5 keyframes at 10 Hz");
}

TEST(BenchmarkTables, GoodEstimatesCountWhetherAcceptedOrNot) {
  BenchmarkRecord record = exampleBenchmark();
  for (WindowResult& result : record.results)  // a gate that refuses everything
    if (!result.attempt.stages.empty()) result.attempt.status = "diverged";
  const Table success = tableOf(record, "success_10_4hz");
  const Table good = tableOf(record, "good_estimates_10_4hz");
  EXPECT_EQ(success.numberAt(0, "good_vi_ba"), 0);
  EXPECT_EQ(good.numberAt(0, "good_vi_ba"), 1.0);  // gravity 0.25 to 1.5 deg after VI-BA
  EXPECT_EQ(good.numberAt(0, "bad_vi_ba"),
            0.4);  // 1 and 0.75; 3 and 2.5 deg are too much, one refused
  EXPECT_EQ(good.numberAt(0, "judged"), 5);
  EXPECT_FALSE(good.hasColumn("good_init"));
  record.protocol.vi_ba = false;
  EXPECT_THROW(find(benchmarkTables(record), "good_estimates_10_4hz"), Error);
}

TEST(BenchmarkTables, NotesNameRecordingsThatAreTooShort) {
  BenchmarkRecord record = exampleBenchmark();
  EXPECT_THAT(find(benchmarkTables(record), "success_10_4hz").note, Not(HasSubstr("too short")));
  BenchmarkSequence shorter;
  shorter.name = "V2";
  shorter.last_image = 2'000'000'000;
  record.sequences.push_back(shorter);
  const std::string sentence =
      "V2: too short for 10 keyframes at 4 Hz (needs 2.12 s, has 2.00 s): 0 windows";
  EXPECT_THAT(find(benchmarkTables(record), "success_10_4hz").note, HasSubstr(sentence));
  EXPECT_THAT(find(benchmarkTables(record), "rre_deg_mean_10_4hz").note, HasSubstr(sentence));
}

TEST(BenchmarkTables, PeopleReadTitleNoteAndMark) {
  const TitledTable table = find(benchmarkTables(exampleBenchmark()), "success_10_4hz");
  for (const TableFormat format :
       {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kHtml, TableFormat::kLatex}) {
    EXPECT_THAT(toString(table, format), HasSubstr("10 keyframes at 4 Hz"));
    EXPECT_THAT(toString(table, format), HasSubstr("a refused window counts as a failure."));
  }
  EXPECT_THAT(toString(table, TableFormat::kMarkdown), HasSubstr("Best in bold, of"));
  const std::string plain = toString(table, TableFormat::kText);
  EXPECT_THAT(plain, AllOf(Not(HasSubstr("\033")), Not(HasSubstr("Best"))));
  const std::string starred = toString(table, TableFormat::kText, {CellMark::kStar, 0});
  EXPECT_THAT(starred,
              AllOf(HasSubstr("60.0*"), HasSubstr("Best marked *, of"), Not(HasSubstr("bold"))));
  const std::string bold = toString(table, TableFormat::kText, {CellMark::kTerminalBold, 0});
  EXPECT_THAT(bold, AllOf(HasSubstr("\033[1m"), HasSubstr("Best in bold, of")));
}

TEST(BenchmarkTables, SayWhatTheyAreOf) {
  const std::vector<TitledTable> tables = benchmarkTables(exampleBenchmark());
  const TitledTable table = find(tables, "ate_m_p90_10_4hz");
  EXPECT_EQ(table.title, "ATE [mm], 90th percentile, 10 keyframes at 4 Hz");
  EXPECT_THAT(table.note, HasSubstr("Over the windows with an estimate"));
  EXPECT_EQ(table.metric, "ate_m");
  EXPECT_EQ(table.statistic, "p90");
  EXPECT_EQ(table.keyframes, 10);
  EXPECT_EQ(table.rate_hz, 4.0);
  EXPECT_EQ(table.table.columns().at(4).key, "bad_vi_ba");
  EXPECT_EQ(table.table.columns().at(4).factor, 1000.0);
  EXPECT_EQ(tables.back().keyframes, 0);  // the ground truth is of all windows
}

/** Fields of a line without quotes. */
std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields = {""};
  for (const char c : line)
    if (c == ',')
      fields.emplace_back();
    else
      fields.back() += c;
  return fields;
}

TEST(BenchmarkTables, CsvIsOneTidyTable) {
  const std::string csv = benchmarkTablesCsv(exampleBenchmark());
  std::istringstream text(csv);
  std::string line;
  std::getline(text, line);
  EXPECT_EQ(line,
            "metric,statistic,keyframes,rate_hz,windows,sequence,initializer,stage,count,value");
  std::set<std::string> keys;
  while (std::getline(text, line)) {
    ASSERT_EQ(fieldsOf(line).size(), 10u) << line;
    const std::string key = line.substr(0, line.rfind(',', line.rfind(',') - 1));
    EXPECT_TRUE(keys.insert(key).second) << line;
  }
  for (const char* expected : {"\nsuccess,rate,10,4,all,V1,good,init,5,0.6\n",
                               "\ngood_estimates,rate,10,4,all,V1,bad,vi_ba,5,0.4\n",
                               "\nrefusals,count,10,4,all,all,bad,vi_ba,6,3\n",
                               "\nfalse_accepts,count,10,4,all,V1,good,init,5,2\n",
                               "\nwindow_s,median,10,4,all,V1,good,vi_ba,0,\n",
                               "\nate_m,p90,10,4,all,V1,good,init,5,0.026\n",
                               "\nruntime_ms: VI-BA,median,10,4,all,all,good,,6,20\n",
                               "\nnoise_gyro_factor,,10,4,all,V1,good,vi_ba,5,2\n",
                               "\nground_truth_rre_deg,,,,,V1,,,,0.0333\n"})
    EXPECT_THAT(csv, HasSubstr(expected));
}

}  // namespace
}  // namespace etalon
