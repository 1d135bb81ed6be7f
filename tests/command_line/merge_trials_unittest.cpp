#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/testing/example_trial.h"
#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/** The result of `etalon merge` on a trial's folder. */
CommandResult merged(const TrialRecord& record, const std::vector<std::string>& options = {}) {
  const TemporaryFolder folder, out;
  writeTrialHead(folder.path(), record);
  LineStore store((folder / "runs").string());
  for (const TrialRun& run : record.results) store.append(run.recording, resultToText(run));
  writeTrialResults(folder.path(), record, nullptr);
  std::vector<std::string> command = {"merge", folder.path(), "--out", out.path() + "/all"};
  command.insert(command.end(), options.begin(), options.end());
  return runEtalon(command);
}

TEST(MergeTrials, PrintsWhatTheTrialPrints) {
  const TrialRecord record = exampleTrial();
  const CommandResult page = merged(record);
  EXPECT_EQ(page.exit_code, 0) << page.err;
  EXPECT_THAT(page.out, AllOf(StartsWith("2 recordings"), Not(HasSubstr("Failures"))));
  EXPECT_THAT(page.err, HasSubstr("16 results of 1 part\n"));
  EXPECT_EQ(merged(record, {"--format", "csv"}).out, runsCsv(record.results));
  EXPECT_THAT(merged(record, {"--verbose"}).out, HasSubstr("Failures"));
}

TEST(MergeTrials, EndsAsTheTrialWouldHave) {
  TrialRecord record = exampleTrial();
  record.results[2].status = kStatusCrashed;
  const CommandResult crashed = merged(record);
  EXPECT_EQ(crashed.exit_code, 4) << crashed.err;
  EXPECT_THAT(crashed.err, HasSubstr("warning: two: 1 run (crashed)"));
  BenchmarkSequence unusable;
  unusable.name = "c";
  unusable.error = "imu0/data.csv: empty";
  record.sequences.push_back(unusable);
  const CommandResult data = merged(record);
  EXPECT_EQ(data.exit_code, 3) << data.err;
  EXPECT_THAT(data.err, HasSubstr("c was left out: imu0/data.csv: empty"));
}

}  // namespace
}  // namespace etalon::testing
