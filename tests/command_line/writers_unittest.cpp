// Whatever is written appears whole or not at all, and what could not be written is said.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>

#include "run_command.h"

namespace etalon::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** Runs a line of the shell, in which $etalon is the program. */
CommandResult runShell(const std::string& line) {
  return runProgram("/bin/sh", {"-c", "etalon='" ETALON_EXECUTABLE "'; " + line});
}

/** A recording of 0.2 s, as simulate writes it. */
std::string simulated(const TemporaryFolder& folder) {
  std::string path = folder.path() + "/flight";
  EXPECT_EQ(runEtalon({"simulate", "--out", path, "--duration", "0.2"}).exit_code, 0);
  return path;
}

TEST(Writers, OfTwoConvertsToOneFileBothAreWhole) {
  const TemporaryFolder folder;
  const std::string flight = simulated(folder), log = folder.path() + "/a.rawlog";
  const std::string convert = "$etalon convert --embed " + flight + " " + log;
  const CommandResult both =
      runShell(convert + " & one=$!; " + convert + "; two=$?; wait $one && exit $two");
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_EQ(runEtalon({"info", log}).exit_code, 0);
  EXPECT_EQ(runShell(convert + "2.rawlog && cmp " + log + " " + log + "2.rawlog").exit_code, 0);
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_NE(entry.path().extension(), ".part");
}

TEST(Writers, AFullDiskIsNoticedAndLeavesWhatWasThere) {
  const TemporaryFolder folder;
  const std::string flight = simulated(folder), out = folder.path() + "/run";
  ASSERT_EQ(runEtalon({"replay", flight, "--out", out}).exit_code, 1);
  const auto written = fs::last_write_time(out + "/trajectory.tum");
  const auto files = [&] {
    return std::distance(fs::directory_iterator(out), fs::directory_iterator());
  };
  const auto before = files();
  // No file longer than 16 blocks: trajectory.tum fits in, run.rawlog does not.
  const std::string full = "ulimit -f 16; ";
  const CommandResult replay = runShell(full + "$etalon replay " + flight + " --out " + out);
  EXPECT_EQ(replay.exit_code, 3);
  EXPECT_THAT(replay.err, AllOf(HasSubstr("cannot be written"), HasSubstr("File too large")));
  EXPECT_EQ(fs::last_write_time(out + "/trajectory.tum"), written);
  EXPECT_EQ(files(), before);

  const CommandResult convert =
      runShell(full + "$etalon convert --embed " + flight + " " + folder.path() + "/b.rawlog");
  EXPECT_EQ(convert.exit_code, 3);
  EXPECT_THAT(convert.err, HasSubstr("cannot be written: File too large"));
  EXPECT_FALSE(fs::exists(folder.path() + "/b.rawlog"));

  const CommandResult simulate =
      runShell(full + "$etalon simulate --duration 0.2 --out " + folder.path() + "/c");
  EXPECT_EQ(simulate.exit_code, 3);
  EXPECT_THAT(simulate.err, HasSubstr("cannot be written: File too large"));
  EXPECT_TRUE(fs::is_empty(folder.path() + "/c/mav0"));
}

TEST(Writers, AFullStandardOutputIsNoticed) {
  const CommandResult result = runShell("$etalon plugins > /dev/full");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("standard output could not be written"));
}

TEST(Writers, AnInterruptedSimulationIsNoRecording) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/flight";
  const CommandResult simulate = runShell(
      "$etalon simulate --threads 1 --duration 600 --out " + out + " & pid=$!; " + "until ls " +
      out + "/mav0/*/cam0/data/*.png > /dev/null 2>&1; do sleep 0.05; done; " +
      "kill -TERM $pid; wait $pid");
  EXPECT_EQ(simulate.exit_code, 128 + 15) << simulate.err;
  for (const char* sensor : {"cam0", "cam1", "imu0", "state_groundtruth_estimate0"})
    EXPECT_FALSE(fs::exists(out + "/mav0/" + sensor)) << sensor;
  EXPECT_EQ(runEtalon({"info", out}).exit_code, 3);
}

TEST(Writers, TooLittleMemoryIsSaid) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer needs terabytes of addresses";
#endif
  const TemporaryFolder folder;
  // kB of addresses: enough to begin, too little for the IMU samples of a day.
  const CommandResult result = runShell(
      "ulimit -v 400000; $etalon simulate --duration 80000 --out " + folder.path() + "/flight");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.err, "etalon: the memory does not suffice\n");
}

}  // namespace
}  // namespace etalon::testing
