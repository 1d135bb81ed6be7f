// The example that feeds the pipeline with MRPT observations from a rawlog.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using ::testing::HasSubstr;

TEST(Observations, OfARawlogGiveAFlight) {
  const TemporaryFolder folder;
  const std::string log = folder.path() + "/flight.rawlog";
  // Below the log's folder, so that the log refers to its images by relative paths.
  std::filesystem::create_directory_symlink(kFlight, folder.path() + "/flight");
  ASSERT_EQ(runEtalon({"convert", folder.path() + "/flight", log}).exit_code, 0);
  const CommandResult run = runProgram(ETALON_OBSERVATIONS_TO_STATES, {log});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("inertial: a start was accepted"));
  EXPECT_THAT(run.out, HasSubstr("80 frames"));
  // The same again, bit for bit.
  EXPECT_EQ(runProgram(ETALON_OBSERVATIONS_TO_STATES, {log}).out, run.out);
  EXPECT_EQ(runProgram(ETALON_OBSERVATIONS_TO_STATES, {folder.path() + "/none"}).exit_code, 3);
}

TEST(Observations, TheExampleSaysWhatItTakes) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{}, {"a.rawlog", "liev"}, {"a.rawlog", "live", "b"}}) {
    const CommandResult run = runProgram(ETALON_OBSERVATIONS_TO_STATES, words);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(run.err, "usage: observations_to_states LOG.rawlog [live]\n");
  }
  const CommandResult folder = runProgram(ETALON_OBSERVATIONS_TO_STATES, {kFlight});
  EXPECT_EQ(folder.exit_code, 3);
  EXPECT_EQ(folder.err,
            std::string(kFlight) +
                ": is no file; expected a rawlog (`etalon convert` makes one of a folder)\n");
}

}  // namespace
}  // namespace etalon::testing
