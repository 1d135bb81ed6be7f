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

/** A recording as simulate writes it, made once for all tests, which must not change it. */
std::string simulated(const std::string& duration_s) {
  static const TemporaryFolder folder;
  std::string path = folder.path() + "/" + duration_s;
  if (!fs::exists(path)) {
    EXPECT_EQ(runEtalon({"simulate", "--out", path, "--duration", duration_s}).exit_code, 0);
  }
  return path;
}

TEST(Writers, OfTwoConvertsToOneFileBothAreWhole) {
  const TemporaryFolder folder;
  const std::string flight = simulated("0.2"), log = folder.path() + "/a.rawlog";
  const std::string convert = "$etalon convert --embed " + flight + " " + log;
  const CommandResult both =
      runShell(convert + " & one=$!; " + convert + "; two=$?; wait $one && exit $two");
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_EQ(runEtalon({"info", log}).exit_code, 0);
  EXPECT_EQ(runShell(convert + "2.rawlog && cmp " + log + " " + log + "2.rawlog").exit_code, 0);
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_NE(entry.path().extension(), ".part");
}

TEST(Writers, AFullDiskIsNoticedAndLosesNothingThatFits) {
  const TemporaryFolder folder;
  const std::string flight = simulated("0.2"), out = folder.path() + "/run";
  // No file longer than 16 blocks: trajectory.tum fits in, run.rawlog does not.
  const std::string full = "ulimit -f 16; ";
  const CommandResult replay = runShell(full + "$etalon replay " + flight + " --out " + out);
  EXPECT_EQ(replay.exit_code, 3);
  EXPECT_THAT(replay.err, AllOf(HasSubstr("not all results could be written: "),
                                HasSubstr(out + "/run.rawlog: cannot be written: File too large")));
  EXPECT_THAT(replay.out, AllOf(HasSubstr("stereo frames, 0.2 s"), HasSubstr("trajectory.tum")));
  for (const char* name : {"trajectory.tum", "states.csv"})
    EXPECT_TRUE(fs::exists(out + "/" + name)) << name;
  EXPECT_FALSE(fs::exists(out + "/run.rawlog"));
  for (const auto& entry : fs::directory_iterator(out))
    EXPECT_NE(entry.path().extension(), ".part");

  const CommandResult convert =
      runShell(full + "$etalon convert --embed " + flight + " " + folder.path() + "/b.rawlog");
  EXPECT_EQ(convert.exit_code, 3);
  EXPECT_THAT(convert.err, HasSubstr("cannot be written: File too large"));
  EXPECT_FALSE(fs::exists(folder.path() + "/b.rawlog"));

  const CommandResult simulate =
      runShell(full + "$etalon simulate --duration 0.2 --out " + folder.path() + "/c");
  EXPECT_EQ(simulate.exit_code, 3);
  EXPECT_THAT(simulate.err, HasSubstr("cannot be written: File too large"));
  EXPECT_FALSE(fs::exists(folder.path() + "/c"));
}

TEST(Writers, OnAFullDiskABagIsRefusedAndNothingIsLeft) {
  const TemporaryFolder folder;
  const std::string flight = simulated("0.2");
  const CommandResult convert =
      runShell("ulimit -f 16; $etalon convert " + flight + " " + folder.path() + "/bag/a.bag");
  EXPECT_EQ(convert.exit_code, 3);
  EXPECT_THAT(convert.err, HasSubstr("/bag/a.bag: the bag cannot be written: "));
  EXPECT_FALSE(fs::exists(folder.path() + "/bag"));
}

TEST(Writers, AFailedConvertLeavesNoFolder) {
  const TemporaryFolder folder;
  const std::string flight = simulated("0.2"), copy = folder.path() + "/new/copy";
  const CommandResult full = runShell("ulimit -f 1; $etalon convert " + flight + " " + copy);
  EXPECT_EQ(full.exit_code, 3) << full.err;
  EXPECT_FALSE(fs::exists(folder.path() + "/new"));
  folder.write("notes.txt", "of mine");
  const CommandResult there = runEtalon({"convert", flight, folder.path()});
  EXPECT_EQ(there.exit_code, 2);
  EXPECT_THAT(there.err, AllOf(HasSubstr("not empty; remove it or choose another"),
                               ::testing::Not(HasSubstr("--force"))));
}

/** Runs `line`, to which it sends SIGTERM as soon as `condition` holds, unless it has ended. */
CommandResult interrupted(const std::string& line, const std::string& condition) {
  return runShell(line + " & pid=$!; until { " + condition +
                  " || ! kill -0 $pid; } > /dev/null 2>&1; do sleep 0.02; done; " +
                  "kill -TERM $pid; wait $pid");
}

TEST(Writers, AnInterruptedConvertLeavesNothing) {
  const TemporaryFolder folder;
  const std::string flight = simulated("6"), log = folder.path() + "/a.rawlog";
  const CommandResult convert =
      interrupted("$etalon convert --embed " + flight + " " + log, "ls " + log + "*.part");
  EXPECT_EQ(convert.exit_code, 130) << convert.err;
  EXPECT_THAT(convert.err, HasSubstr("convert: interrupted; nothing is written"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Writers, AnInterruptedReplayKeepsWhatWasFlown) {
  const TemporaryFolder folder;
  const std::string flight = simulated("6"), out = folder.path() + "/run";
  const std::string said = folder.path() + "/said";
  const CommandResult replay = interrupted(
      "$etalon replay " + flight + " --out " + out + " > " + said, "grep -q initialized " + said);
  EXPECT_EQ(replay.exit_code, 130) << replay.err;
  EXPECT_THAT(replay.err, HasSubstr("what was flown is written"));
  EXPECT_TRUE(fs::exists(out + "/trajectory.tum"));
}

TEST(Writers, AnInterruptedAdjustmentKeepsTheFlight) {
  const TemporaryFolder folder;
  const std::string flight = simulated("6"), out = folder.path() + "/run";
  const std::string said = folder.path() + "/said";
  const CommandResult replay =
      interrupted("$etalon replay --final-ba " + flight + " --out " + out + " > " + said,
                  "grep -q 'final bundle' " + said);
  EXPECT_EQ(replay.exit_code, 130) << replay.err;
  EXPECT_THAT(replay.err, HasSubstr("interrupted at the final bundle adjustment; what was flown is "
                                    "written, without trajectory_final.tum"));
  EXPECT_TRUE(fs::exists(out + "/trajectory.tum"));
  EXPECT_TRUE(fs::exists(out + "/trajectory_smoothed.tum"));
  EXPECT_FALSE(fs::exists(out + "/trajectory_final.tum"));
}

TEST(Writers, AnErrorInFlightKeepsWhatWasFlown) {
  const TemporaryFolder folder;
  const std::string flight = simulated("1.2"), out = folder.path() + "/run";
  const CommandResult replay =
      runEtalon({"replay", flight, "--out", out, "--plugin-path",
                 ETALON_BAD_PLUGINS "/throws_when_asked.so", "--initializer", "auto", "--set",
                 "auto.at_rest=orbslam3_inertial_only", "--set", "auto.moving=throws_when_asked",
                 "--set", "pipeline.keyframes=4", "--set", "acceptance.min_measurements=1000000"});
  EXPECT_EQ(replay.exit_code, 3);
  EXPECT_THAT(replay.err, HasSubstr("unexpected error: thrown in flight"));
  EXPECT_THAT(replay.out, HasSubstr("trajectory.tum"));
  for (const char* name : {"trajectory.tum", "states.csv", "run.rawlog", "initialization.json"})
    EXPECT_TRUE(fs::exists(out + "/" + name)) << name;
}

TEST(Writers, AnAdjustmentThatIsKilledKeepsTheFlight) {
  const TemporaryFolder folder;
  const std::string flight = simulated("6"), out = folder.path() + "/run",
                    said = folder.path() + "/said";
  // As the kernel does where memory runs out: the process that flies, not its supervisor.
  const CommandResult replay =
      runShell("$etalon replay --final-ba " + flight + " --out " + out + " > " + said +
               " & pid=$!; until grep -q 'final bundle' " + said +
               " || ! kill -0 $pid; do sleep 0.01; done" +
               " 2> /dev/null; kill -KILL $(cat /proc/$pid/task/*/children); wait $pid");
  EXPECT_EQ(replay.exit_code, 4) << replay.err;
  EXPECT_THAT(replay.err,
              HasSubstr("keeping what came before, without the final bundle adjustment"));
  EXPECT_TRUE(fs::exists(out + "/trajectory.tum"));
  EXPECT_FALSE(fs::exists(out + "/trajectory_final.tum"));
}

/** A condition for interrupted(): the program has its handler of SIGTERM, bit 14 of the mask. */
std::string catchesSigterm() { return "grep -q 'SigCgt:.*[4-7c-f]...$' /proc/$pid/status"; }

TEST(Writers, WhoeverWritesAtTheEndSaysThatItIsInterrupted) {
  const TemporaryFolder folder;
  const std::string flight = simulated("6"), device = folder.path() + "/device.ini";
  const CommandResult calibrate =
      interrupted("$etalon calibrate-device " + flight + " --out " + device, catchesSigterm());
  EXPECT_EQ(calibrate.exit_code, 130);
  EXPECT_THAT(calibrate.err, HasSubstr("calibrate-device: interrupted; nothing is written\n"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
  const std::string said = folder.path() + "/said";
  const CommandResult check =
      interrupted("$etalon check-plugin eta --windows 100000 > " + said, "grep -q passed " + said);
  EXPECT_EQ(check.exit_code, 130);
  EXPECT_EQ(check.err, "check-plugin: interrupted; the plugin is not judged\n");
}

TEST(Writers, ADeviceFileReplacesNoOtherFile) {
  const TemporaryFolder folder;
  const std::string text = folder.write("README.md", "# Of mine\n");
  const CommandResult result = runEtalon({"calibrate-device", "/no/such/recording", "--out", text});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("README.md is there and is no device file"),
                                HasSubstr("choose another name or remove it")));
}

TEST(Writers, ResultsDoNotReplaceTheConfigurationThatWasGiven) {
  const TemporaryFolder folder;
  const std::string config = folder.write("config.ini", "[pipeline]\nkeyframes = 9\n");
  for (const char* command : {"replay", "bench", "trial"}) {
    const CommandResult result =
        runEtalon({command, "/no/such/recording", "-c", config, "--out", folder.path()});
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_THAT(result.err, HasSubstr("would replace " + config)) << command;
  }
}

TEST(Writers, AFullStandardOutputIsNoticed) {
  const TemporaryFolder folder;
  const std::string replay = "replay " + simulated("0.2") + " --out " + folder.path() + "/run";
  for (const std::string& command : {std::string("plugins"), replay}) {
    const CommandResult result = runShell("$etalon " + command + " > /dev/full");
    EXPECT_EQ(result.exit_code, 3) << command;
    EXPECT_THAT(result.err, HasSubstr("standard output could not be written")) << command;
  }
}

TEST(Writers, AnInterruptedSimulationIsNoRecording) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/flight";
  const CommandResult simulate =
      interrupted("$etalon simulate --threads 1 --duration 600 --out " + out,
                  "ls " + out + "/mav0/*/cam0/data/*.png");
  EXPECT_EQ(simulate.exit_code, 130) << simulate.err;
  EXPECT_THAT(simulate.err, HasSubstr("simulate: interrupted; nothing is written"));
  EXPECT_FALSE(fs::exists(out));
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
