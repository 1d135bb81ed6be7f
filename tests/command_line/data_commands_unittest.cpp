#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/** Expects the exit code, nothing on stdout, and every text in the message. */
void expectFails(const std::vector<std::string>& arguments, int exit_code,
                 const std::vector<std::string>& expected) {
  const CommandResult result = runEtalon(arguments);
  EXPECT_EQ(result.exit_code, exit_code) << arguments.front() << ": " << result.err;
  EXPECT_THAT(result.out, IsEmpty());
  EXPECT_THAT(result.err, HasSubstr("etalon: "));
  for (const std::string& text : expected) EXPECT_THAT(result.err, HasSubstr(text));
}

/** Whether a terminal can show it: the reader of a message is no binary file. */
bool isPlainText(const std::string& text) {
  for (const char c : text)
    if (c != '\n' && c != '\r' && (c < ' ' || c > '~')) return false;
  return true;
}

/** The command that reads `source`, with whatever else it needs; it must not get as far as to
 * write. */
std::vector<std::vector<std::string>> readersOf(const std::string& source,
                                                const TemporaryFolder& folder) {
  return {{"info", source},
          {"info", source, "--json"},
          {"convert", source, folder.path() + "/converted.rawlog"},
          {"replay", source, "--out", folder.path() + "/run"}};
}

TEST(DataCommands, RefuseASourceThatIsNotThere) {
  const TemporaryFolder folder;
  for (const auto& arguments : readersOf("/no/such/recording", folder))
    expectFails(arguments, 3, {"/no/such/recording", "a ROS bag", "a EuRoC (ASL) folder"});
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DataCommands, RefuseAFolderThatIsNoRecording) {
  const TemporaryFolder folder, empty;
  for (const auto& arguments : readersOf(empty.path(), folder))
    expectFails(arguments, 3, {empty.path(), "cam0", "expected a EuRoC (ASL) folder"});
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DataCommands, RefuseAFileThatIsNoRawlogInPlainText) {
  std::string noise;
  for (int i = 0; i < 4000; ++i) noise += static_cast<char>((i * 7919 + i * i * 31) >> 3 & 0xFF);
  const TemporaryFolder folder, sources;
  const std::vector<std::string> files = {
      sources.write("text.rawlog", "no log at all\n"), sources.write("noise.rawlog", noise),
      sources.write("noise", std::string(1, '\x01') + noise), sources.write("empty.rawlog", "")};
  for (const std::string& file : files) {
    for (const auto& arguments : readersOf(file, folder)) expectFails(arguments, 3, {file});
    EXPECT_TRUE(isPlainText(runEtalon({"info", file}).err)) << file;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DataCommands, TakePathsOfAnyBytes) {
  const TemporaryFolder folder;
  const std::string flight = folder.path() + "/caf\xe9", log = folder.path() + "/\xe9.rawlog";
  ASSERT_EQ(runEtalon({"simulate", "--out", flight, "--duration", "0.2"}).exit_code, 0);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"convert", flight, log}, {"info", "--json", log}}) {
    const CommandResult result = runEtalon(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
  }
}

TEST(ReplayCommand, SaysWhyThereWasNoAttempt) {
  const TemporaryFolder folder;
  const std::string flight = folder.path() + "/flight", out = folder.path() + "/run";
  ASSERT_EQ(runEtalon({"simulate", "--out", flight, "--duration", "1.2"}).exit_code, 0);
  EXPECT_THAT(runEtalon({"replay", flight, "--to", "0.4", "--out", out}).out,
              HasSubstr("in 0 attempts: the part is shorter than the window of keyframes"));
  const CommandResult apart =
      runEtalon({"replay", flight, "--out", out, "--set", "input.max_gap_s=0.04"});
  EXPECT_EQ(apart.exit_code, 1) << apart.err;
  EXPECT_THAT(apart.out, HasSubstr("in 0 attempts: the images are too far apart for a window of 3 "
                                   "keyframes, which begins anew after a gap of more than 0.04 s"));
}

TEST(ConvertCommand, RefusesADestinationThatIsNoRawlog) {
  expectFails({"convert", "/no/such/recording", "/tmp/log.txt"}, 2, {".rawlog", "/tmp/log.txt"});
  expectFails({"convert", "/no/such/recording"}, 2, {"DST", "--help"});
  for (const char* destination : {"/tmp/folder", "/tmp/a.bag", "/tmp/a/a.db3"})
    expectFails({"convert", "--embed", "/no/such/recording", destination}, 2,
                {"--embed is for a rawlog"});
  expectFails({"convert", "/no/such/recording", "/tmp/a.rawlog", "extra"}, 2, {"extra", "--help"});
}

TEST(CompareCommand, RefusesWhatIsNoRun) {
  const TemporaryFolder folder;
  const std::string text = folder.write("text.rawlog", "no log at all\n");
  expectFails({"compare", folder.path()}, 3, {folder.path() + "/run.rawlog", "etalon replay"});
  expectFails({"compare", "/no/such/run"}, 3, {"/no/such/run", "etalon replay"});
  expectFails({"compare", text}, 3, {text, "expected an MRPT rawlog"});
  expectFails({"compare"}, 2, {"RUN", "--help"});
  expectFails({"compare", folder.path(), "--format", "xml"}, 2, {"--format", "xml", "csv"});
  expectFails({"compare", folder.path(), "--metric", "rre_deg"}, 2, {"--metric", "benchmarks"});
  expectFails({"compare", folder.path(), "--metric", "speed"}, 2, {"--metric", "speed", "rre_deg"});
  expectFails({"compare", folder.path(), "--seed", "-1"}, 2, {"--seed", "whole number"});
}

TEST(CompareCommand, SaysThatRunsOfOtherRecordingsOrPartsCannotBeCompared) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& name, const std::string& flight, const char* to) {
    const std::string out = folder.path() + "/" + name;
    runEtalon({"replay", folder.path() + "/" + flight, "--to", to, "--out", out});
    return out;
  };
  for (const char* flight : {"here", "there"})
    ASSERT_EQ(runEtalon({"simulate", "--out", folder.path() + "/" + flight, "--duration", "0.6"})
                  .exit_code,
              0);
  const std::string whole = run("whole", "here", "1"), same = run("same", "here", "1"),
                    part = run("part", "here", "0.2"), other = run("other", "there", "1");
  EXPECT_THAT(runEtalon({"compare", whole, same}).err, IsEmpty());
  const CommandResult result = runEtalon({"compare", whole, same, part, other});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: part is a run of another part of here (0.20 s"));
  EXPECT_THAT(result.err, HasSubstr("warning: other is a run of another recording (there, not "
                                    "here) than whole: their errors cannot be compared"));
  const std::string picture = folder.path() + "/picture.png";
  expectFails({"compare", whole, other, "--save-plot", picture}, 2,
              {"--save-plot", "whole is of here, other of there"});
  EXPECT_FALSE(std::filesystem::exists(picture));
  // A run of a part is held against that part.
  const CommandResult judged =
      runEtalon({"compare", part, "--recording", folder.path() + "/here", "--format", "csv"});
  EXPECT_EQ(judged.exit_code, 0) << judged.err;
  EXPECT_THAT(judged.out, HasSubstr(",5,5,1,"));  // frames, poses, coverage
  // Runs in a folder are named.
  expectFails({"compare", folder.path()}, 2, {"no run, but runs are in it", other, part, whole});
}

TEST(CompareCommand, RefusesOptionsOfOtherFolders) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& option : std::vector<std::vector<std::string>>{
           {"--seed", "3"}, {"--all"}, {"--bold"}, {"--initializers", "eta"}}) {
    std::vector<std::string> arguments = {"compare", folder.path()};
    arguments.insert(arguments.end(), option.begin(), option.end());
    expectFails(arguments, 2, {option[0] + ": expected folders of benchmarks"});
  }
  expectFails({"compare", "a.tum", "--recording", "b", "--seed", "3", "--min-coverage", "0.3"}, 2,
              {"--seed: expected folders of benchmarks, without --recording"});
  expectFails({"compare", "a.tum", "--recording", "b", "--min-coverage", "0.3"}, 2,
              {"--min-coverage: expected folders of runs or benchmarks"});
}

TEST(InfoCommand, SaysOfAnUnknownFileWhatIsRead) {
  const TemporaryFolder folder;
  const std::string words = "something else\n";
  expectFails({"info", folder.write("a.bag", words)}, 3, {"a.bag: is no recording", "ROS 1"});
  expectFails({"info", folder.write("a.db3", words)}, 3, {"a.db3: is no recording", "sqlite3"});
  expectFails({"info", folder.write("a.mcap", words)}, 3, {"MCAP", "ros2 bag convert"});
  expectFails({"info", folder.write("a.txt", words)}, 3, {"a.txt: is no recording", ".rawlog"});
  expectFails({"info", folder.write("zero.rawlog", "")}, 3, {"zero.rawlog: the file is empty"});
}

TEST(SimulateCommand, RefusesWrongValues) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/flight";
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> wrong = {
      {{"--profile", "wild"}, {"--profile", "wild", "aggressive"}},
      {{"--camera", "mirror"}, {"--camera", "mirror", "fisheye"}},
      {{"--duration", "0"}, {"duration", "more than 0 s"}},
      {{"--duration", "-1"}, {"duration", "more than 0 s"}},
      {{"--duration", "nan"}, {"duration", "more than 0 s"}},
      {{"--duration", "long"}, {"--duration", "long"}},
      {{"--seed", "-1"}, {"--seed", "'-1'", "whole number"}},
      {{"--seed", "1.5"}, {"--seed", "'1.5'", "whole number"}},
      {{"--seed", "99999999999999999999"}, {"--seed", "whole number"}},
      {{"--blur", "-1"}, {"--blur", "-1"}},
      {{"--threads", "many"}, {"--threads", "many"}},
      {{"--imu", "imu.csv"}, {"--imu", "--trajectory"}},
      {{"--stamps", "stamps.txt"}, {"--stamps", "--trajectory"}},
      {{"--from", "3"}, {"--from", "--trajectory"}},
      {{"--trajectory", "gt.csv", "--profile", "static"}, {"--profile", "--trajectory"}}};
  for (const auto& [words, expected] : wrong) {
    std::vector<std::string> arguments = {"simulate", "--out", out};
    arguments.insert(arguments.end(), words.begin(), words.end());
    expectFails(arguments, 2, expected);
  }
  expectFails({"simulate"}, 2, {"--out"});
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(SimulateCommand, SaysFileAndLineOfAWrongTrajectory) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/flight";
  expectFails({"simulate", "--out", out, "--trajectory", "/no/such.csv"}, 3, {"/no/such.csv"});
  const std::string row = "1400000000000000000,0,0,1,1,0,0,0\n";
  const std::string words = folder.write("words.csv", "#stamp\nsoon,0,0,1,1,0,0,0\n");
  expectFails({"simulate", "--out", out, "--trajectory", words}, 3, {words + ":2", "soon"});
  const std::string twice = folder.write("twice.csv", row + row);
  expectFails({"simulate", "--out", out, "--trajectory", twice}, 3, {twice + ":2"});
  const std::string short_row = folder.write("short.csv", "1400000000000000000,0,0,1\n");
  expectFails({"simulate", "--out", out, "--trajectory", short_row}, 3,
              {short_row + ":1", "8 or 17 columns"});
}

TEST(SimulateCommand, DoesNotWriteOverWhatIsThere) {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "of mine");
  expectFails({"simulate", "--out", file, "--duration", "0.1"}, 2, {file, "not a folder"});
  expectFails({"simulate", "--out", folder.path(), "--duration", "0.1"}, 2,
              {folder.path(), "not empty", "--force"});
  expectFails({"simulate", "--out", file + "/below", "--duration", "0.1"}, 3, {file + "/below"});
}

}  // namespace
}  // namespace etalon::testing
