#include "etalon/report/trial_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/text.h"
#include "etalon/testing/example_trial.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::exampleTrial;
using ::testing::HasSubstr;
using ::testing::Not;

const Table& tableOf(const std::vector<TitledTable>& tables, const std::string& id) {
  for (const TitledTable& table : tables)
    if (table.id == id) return table.table;
  throw std::runtime_error("no table " + id);
}

std::vector<std::string> linesOf(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/** Ten starts, three variants and twenty faults, the first of which every run fails. */
TrialRecord largeTrial() {
  TrialRecord record = exampleTrial();
  record.initializers.push_back({"three", "1", "", "plugin", ""});
  record.protocol.starts = 10;
  record.faults = {{kNoFault, ""}};
  for (int f = 1; f <= 20; ++f) record.faults.push_back({format("fault_%02d", f), "covered"});
  record.results.clear();
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const double from_s : startsOf(record.protocol, sequence))
      for (const TrialVariant& variant : variantsOf(record))
        for (size_t f = 0; f < record.faults.size(); ++f) {
          TrialRun run = testing::exampleRun(sequence.name, from_s, variant, record.faults[f].name,
                                             2.0 + static_cast<double>(f));
          if (f == 1) {
            run.status = kStatusFailed;
            run.reason = "lost since 7.10 s: " + std::string(120, 'x');
          }
          record.results.push_back(run);
        }
  return record;
}

TEST(TrialTables, SayWhatEachVariantIsWorth) {
  const std::vector<TitledTable> tables = trialTables(exampleTrial());
  const Table& table = tableOf(tables, "variants");
  ASSERT_EQ(table.rowCount(), 2U);
  EXPECT_EQ(table.textAt(0, "variant"), "one");
  EXPECT_EQ(table.textAt(0, "survived"), "8/8");
  EXPECT_EQ(table.textAt(1, "survived"), "7/8");
  EXPECT_EQ(table.numberAt(1, "silent"), 1.0);
  EXPECT_NEAR(table.numberAt(0, "causal_ate_m"), 0.0025, 1e-12);  // without a fault
  EXPECT_NEAR(table.numberAt(1, "coverage"), 1.0 - 50.0 / 1600.0, 1e-12);
  EXPECT_EQ(tables.front().title, "2 recordings, 4 starts of 10 s, 1 fault");
  EXPECT_THAT(tables.front().note, HasSubstr("ATE <= 0.5 m"));
}

TEST(TrialTables, SayWhatEachFaultDoes) {
  const std::vector<TitledTable> tables = trialTables(exampleTrial());
  const Table& table = tableOf(tables, "faults");
  ASSERT_EQ(table.rowCount(), 2U);
  EXPECT_EQ(table.textAt(0, "fault"), kNoFault);
  EXPECT_EQ(table.textAt(0, "reported"), "");
  EXPECT_EQ(table.textAt(1, "survived_0"), "4/4");
  EXPECT_EQ(table.textAt(1, "survived_1"), "3/4");
  EXPECT_EQ(table.textAt(1, "reported"), "7/8");
  EXPECT_NEAR(table.numberAt(1, "added_m"), 0.0035, 1e-12);
  EXPECT_NEAR(table.numberAt(1, "largest_added_m"), 0.004, 1e-12);
}

TEST(TrialTables, SayWhatAnInitializerIsWorthAfterTheStart) {
  const std::vector<TitledTable> tables = trialTables(exampleTrial());
  const Table& table = tableOf(tables, "after_start");
  EXPECT_NEAR(table.numberAt(1, "after_5s_ate_m"), 0.0035, 1e-12);
  EXPECT_NEAR(table.numberAt(1, "at_end_tilt_deg"), 0.5, 1e-12);
  EXPECT_NEAR(table.numberAt(0, "after_10s_velocity_mps"), 0.004, 1e-12);
}

TEST(TrialTables, EveryFailureHasItsReason) {
  const std::vector<TitledTable> tables = trialTables(exampleTrial());
  const Table& table = tableOf(tables, "failures");
  ASSERT_EQ(table.rowCount(), 1U);
  EXPECT_EQ(table.textAt(0, "recording"), "b");
  EXPECT_THAT(table.textAt(0, "reason"), HasSubstr("silent: off by 0.62 m"));
  TrialRecord good = exampleTrial();
  good.results.pop_back();
  EXPECT_EQ(trialTables(good).back().note, "No run that was judged failed.");
}

TEST(TrialTables, OneVariantIsComparedWithNothing) {
  TrialRecord record = exampleTrial();
  record.initializers.resize(1);
  sortResults(&record);  // drops the others' runs
  std::vector<std::string> ids;
  for (const TitledTable& table : trialTables(record)) ids.push_back(table.id);
  EXPECT_THAT(ids, ElementsAre("variants", "faults", "after_start", "recordings", "failures"));
  EXPECT_EQ(tableOf(trialTables(record), "faults").textAt(1, "survived"), "4/4");
}

/** The example with a system that survived one of its runs and has no file of the others. */
TrialRecord withASystem() {
  TrialRecord record = exampleTrial();
  record.systems = {{"theirs", "/theirs"}};
  const std::vector<TrialRun> ours = record.results;
  for (const TrialRun& run : ours) {
    if (run.variant.initializer != "one") continue;
    TrialRun theirs = run;
    theirs.variant = {"theirs", "", "", ""};
    theirs.end_state = theirs.event = "";
    if (run.fault != kNoFault || run.from_s > 0.0) {
      theirs.status = kStatusFailed;
      theirs.reason =
          "there is no trajectory '" + trajectoryName(run.recording, run.from_s, run.fault) + "'";
      theirs.poses = 0;
      theirs.causal = theirs.smoothed = TrialErrors();
      theirs.started_s = WindowErrors::kNone;
      theirs.after_start.clear();
    }
    record.results.push_back(theirs);
  }
  sortResults(&record);
  return record;
}

TEST(TrialTables, ASystemWithoutPosesIsNoGoodSystem) {
  const TrialRecord record = withASystem();
  const std::vector<TitledTable> tables = trialTables(record);
  const Table& table = tableOf(tables, "variants");
  ASSERT_EQ(table.rowCount(), 3U);
  EXPECT_EQ(table.textAt(2, "variant"), "theirs");
  EXPECT_EQ(table.textAt(2, "survived"), "2/8");
  EXPECT_NEAR(table.numberAt(2, "coverage"), 0.25, 1e-12);
  EXPECT_NEAR(table.numberAt(2, "causal_ate_m"), 0.0025, 1e-12);  // of the runs that it has
  const Table& faults = tableOf(tables, "faults");
  EXPECT_EQ(faults.textAt(0, "survived_2"), "2/4");
  EXPECT_EQ(faults.textAt(1, "survived_2"), "0/4");
  EXPECT_EQ(tableOf(tables, "failures").rowCount(), 7U);
  EXPECT_THAT(trialPage(record, {}),
              HasSubstr("6 failed, e.g. a from 0 s, theirs, dark: there is"));
}

TEST(TrialTables, DifferencesAreOverTheRunsThatBothHave) {
  const std::vector<TitledTable> tables = trialTables(withASystem());
  const Table& table = tableOf(tables, "differences");
  ASSERT_EQ(table.rowCount(), 2U);
  EXPECT_EQ(table.textAt(1, "a"), "theirs");
  EXPECT_EQ(table.textAt(1, "b"), "one");
  EXPECT_EQ(table.numberAt(1, "pairs"), 2.0);
  EXPECT_NEAR(table.numberAt(1, "difference_m"), 0.0, 1e-12);
  EXPECT_EQ(table.textAt(1, "verdict"), "too few pairs");
}

TEST(TrialTables, ManyVariantsHaveOneColumnTogether) {
  TrialRecord record = exampleTrial();
  const std::vector<TrialRun> runs = record.results;
  record.results.clear();
  record.settings = {{"narrow", ""}, {"wide", ""}, {"widest", ""}};
  for (const NamedText& setting : record.settings)
    for (TrialRun run : runs) {
      run.variant.setting = setting.name;
      record.results.push_back(run);
    }
  sortResults(&record);
  ASSERT_EQ(record.results.size(), 48U);
  const std::vector<TitledTable> tables = trialTables(record);
  const Table& faults = tableOf(tables, "faults");
  EXPECT_FALSE(faults.hasColumn("survived_0"));
  EXPECT_EQ(faults.textAt(1, "survived"), "21/24");
  const Table& variants = tableOf(tables, "variants");
  ASSERT_EQ(variants.rowCount(), 6U);
  EXPECT_EQ(variants.textAt(0, "variant"), "narrow: one");
  EXPECT_EQ(variants.textAt(5, "variant"), "widest: two");
}

TEST(TrialTables, WithoutFaultsThereIsNoTableOfThemOnTheScreen) {
  TrialRecord record = exampleTrial();
  record.faults.resize(1);
  sortResults(&record);
  EXPECT_THAT(trialPage(record, {}), Not(HasSubstr("What each fault does")));
  EXPECT_EQ(trialTables(record).front().title, "2 recordings, 4 starts of 10 s, 0 faults");
}

TEST(TrialTables, ByRecording) {
  const std::vector<TitledTable> tables = trialTables(exampleTrial());
  const Table& table = tableOf(tables, "recordings");
  ASSERT_EQ(table.rowCount(), 4U);
  EXPECT_EQ(table.textAt(2, "recording"), "b");
  EXPECT_NEAR(table.numberAt(2, "causal_ate_m"), 0.003, 1e-12);
  EXPECT_NEAR(table.numberAt(3, "added_m"), 0.004, 1e-12);
  EXPECT_EQ(table.textAt(3, "survived"), "3/4");
}

TEST(TrialTables, ARecordingThatCouldNotBeReadIsNotCounted) {
  TrialRecord record = exampleTrial();
  record.sequences.back().error = "no such file";
  sortResults(&record);
  const std::vector<TitledTable> tables = trialTables(record);
  EXPECT_EQ(tables.front().title, "1 recording, 2 starts of 10 s, 1 fault");
  EXPECT_EQ(tableOf(tables, "recordings").rowCount(), 2U);
  EXPECT_EQ(tableOf(tables, "variants").textAt(0, "survived"), "4/4");
}

TEST(TrialTables, AreTablesInEveryFormat) {
  const TrialRecord record = withASystem();
  for (const TitledTable& table : trialTables(record)) {
    const std::vector<std::string> csv = linesOf(toString(table, TableFormat::kCsv));
    ASSERT_EQ(csv.size(), table.table.rowCount() + 1) << table.id;
    const auto commas = std::count(csv[0].begin(), csv[0].end(), ',');
    if (table.id == "variants") {
      for (const std::string& line : csv)
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas) << line;
    }
    const std::string markdown = toString(table, TableFormat::kMarkdown);
    EXPECT_THAT(markdown, HasSubstr("**" + table.title + "**")) << table.id;
    const std::vector<std::string> lines = linesOf(markdown);
    const auto bars = std::count(lines.back().begin(), lines.back().end(), '|');
    const auto header = std::find_if(lines.begin(), lines.end(),
                                     [](const std::string& line) { return line[0] == '|'; });
    ASSERT_NE(header, lines.end()) << table.id;
    EXPECT_EQ(std::count(header->begin(), header->end(), '|'), bars) << table.id;
    EXPECT_THAT(toString(table, TableFormat::kLatex), HasSubstr("\\toprule")) << table.id;
  }
}

TEST(TrialTables, EveryColumnHasAKeyOfItsOwn) {
  for (const TitledTable& table : trialTables(exampleTrial())) {
    std::vector<std::string> keys;
    for (const Table::Column& column : table.table.columns()) keys.push_back(column.key);
    std::sort(keys.begin(), keys.end());
    EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end()) << table.id;
  }
}

TEST(TrialTables, WhatIsNotKnownIsADash) {
  TrialRecord record = exampleTrial();
  for (TrialRun& run : record.results) {
    run.causal = run.smoothed = TrialErrors();  // no ground truth
    run.after_start.clear();
  }
  const std::vector<TitledTable> tables = trialTables(record);
  EXPECT_TRUE(std::isnan(tableOf(tables, "variants").numberAt(0, "causal_ate_m")));
  EXPECT_TRUE(std::isnan(tableOf(tables, "faults").numberAt(1, "largest_added_m")));
  EXPECT_EQ(tableOf(tables, "differences").numberAt(0, "pairs"), 0.0);
  EXPECT_EQ(tableOf(tables, "differences").textAt(0, "verdict"), "too few pairs");
  EXPECT_LE(linesOf(trialPage(record, {})).size(), 30U);
}

TEST(TrialPage, MarksNothingButTitles) {
  const TextStyle bold{CellMark::kTerminalBold, 40};
  const std::string page = trialPage(exampleTrial(), bold);
  EXPECT_THAT(page, HasSubstr("\033[1m2 recordings"));
  // Tables are never cut, whatever the width of the terminal: the page is made for 100 columns.
  EXPECT_EQ(linesOf(page).size(), linesOf(trialPage(exampleTrial(), {})).size());
}

TEST(TrialPage, CountsWhatDoesNotFit) {
  TrialRecord record = exampleTrial();
  for (size_t i = 0; i < record.results.size(); ++i) {
    record.results[i].status = kStatusFailed;
    record.results[i].reason = std::string("reason ") + static_cast<char>('a' + i);
  }
  const std::string page = trialPage(record, {}, 25);
  const std::vector<std::string> lines = linesOf(page);
  EXPECT_EQ(lines.size(), 25U) << page;
  EXPECT_THAT(lines.back(), HasSubstr("other failures: report.html, runs.csv"));
}

/** Trajectories of two systems alone, as `etalon compare` has them: nothing of ours flew. */
TrialRecord systemsAlone() {
  TrialRecord record = exampleTrial();
  record.settings.clear();
  record.initializers.clear();
  record.systems = {{"theirs", "/theirs"}, {"others", "/others"}};
  record.protocol.seconds = 0.0;
  record.faults.resize(1);
  record.results.clear();
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const NamedText& system : record.systems) {
      TrialRun run = testing::exampleRun(sequence.name, 0.0, {system.name, "", "", ""}, kNoFault,
                                         system.name == "theirs" ? 20.0 : 35.0);
      run.smoothed = TrialErrors();
      run.end_state.clear();
      record.results.push_back(run);
    }
  return record;
}

TEST(TrialTables, OfTrajectoriesAlone) {
  const TrialRecord record = systemsAlone();
  const std::vector<TitledTable> tables = trialTables(record);
  EXPECT_EQ(tables.front().title, "2 recordings, 2 starts to the end, 0 faults");
  const Table& table = tableOf(tables, "variants");
  ASSERT_EQ(table.rowCount(), 2U);
  EXPECT_EQ(table.textAt(0, "variant"), "theirs");
  EXPECT_NEAR(table.numberAt(1, "causal_ate_m"), 0.035, 1e-12);
  EXPECT_TRUE(std::isnan(table.numberAt(1, "smoothed_ate_m")));
  EXPECT_NEAR(tableOf(tables, "differences").numberAt(0, "difference_m"), 0.015, 1e-12);
  EXPECT_TRUE(failuresOf(record).empty());
  EXPECT_THAT(trialPage(record, {}), AllOf(HasSubstr("others"), Not(HasSubstr("failed"))));
}

TEST(TrialPage, FitsAScreen) {
  for (const TrialRecord& record : {exampleTrial(), largeTrial(), withASystem()}) {
    const std::string page = trialPage(record, {});
    const std::vector<std::string> lines = linesOf(page);
    EXPECT_LE(lines.size(), 30U) << page;
    for (const std::string& line : lines) EXPECT_LE(displayWidth(line), 100U) << line;
  }
}

TEST(TrialPage, KeepsTheWorstFaultsAndCountsTheOthers) {
  const std::string page = trialPage(largeTrial(), {});
  EXPECT_THAT(page, AllOf(HasSubstr("fault_01"), HasSubstr("fault_20"), HasSubstr("none")));
  EXPECT_THAT(page, Not(HasSubstr("fault_02")));
  EXPECT_THAT(page, HasSubstr("milder faults in report.html"));
  EXPECT_THAT(page, HasSubstr("60 failed, e.g. a from 0 s, one, fault_01: lost since 7.10 s: xx"));
}

}  // namespace
}  // namespace etalon
