#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Usage, WithoutArgumentsPrintsHelpAndFails) {
  const CommandResult result = runEtalon({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("Usage: etalon"), HasSubstr("plugins")));
  EXPECT_THAT(result.out, IsEmpty());
}

TEST(Usage, HelpNamesCommandsAndExitCodes) {
  for (const char* flag : {"--help", "-h"}) {
    const CommandResult result = runEtalon({flag});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, IsEmpty());
    for (const char* word : {"info", "convert", "simulate", "replay", "compare", "evaluate",
                             "plugins", "Exit codes"}) {
      EXPECT_THAT(result.out, HasSubstr(word));
    }
  }
}

TEST(Usage, EveryCommandHasHelpThatNamesItsOptions) {
  const std::map<std::string, std::vector<std::string>> options = {
      {"info", {"SRC", "--json"}},
      {"convert", {"SRC", "DST", "--embed"}},
      {"simulate",
       {"--out", "--force", "--seed", "--duration", "--profile", "--trajectory", "--imu",
        "--stamps", "--camera", "--from", "--blur", "--noise-free", "--threads"}},
      {"replay",
       {"SRC", "--config", "--initializer", "--from", "--to", "--set", "--plugin-path", "--out",
        "1 never initialized"}},
      {"compare",
       {"RUN", "--format", "csv", "latex", "markdown", "--initializers", "--metric", "--seed"}},
      {"evaluate",
       {"TRAJECTORY", "GT", "--align", "--delta", "--unit", "--max-time-difference", "--format",
        "--plot"}},
      {"plugins", {"--plugin-path", "--describe", "--ini"}}};
  for (const auto& [command, words] : options) {
    const CommandResult result = runEtalon({command, "--help"});
    EXPECT_EQ(result.exit_code, 0) << command;
    EXPECT_THAT(result.err, IsEmpty());
    EXPECT_THAT(result.out, HasSubstr("Usage: etalon " + command));
    for (const std::string& word : words) EXPECT_THAT(result.out, HasSubstr(word)) << command;
  }
}

TEST(Usage, EveryCommandHasItsOwnExitCodes) {
  const std::string common = "Exit codes: 0 done, 2 usage or configuration, 3 data.";
  const std::map<std::string, std::string> codes = {
      {"info", "or no result of it can be right"},
      {"convert", "3 data, 130 interrupted"},
      {"simulate", "3 data, 130 interrupted (nothing is written)"},
      {"compare", "1 done, but a benchmark is unfinished"},
      {"evaluate", common},
      {"ground-truth", "3 data"},
      {"calibrate-device", "used up its time"},
      {"replay", "130 interrupted (what was flown is written"},
      {"bench", "4 an initializer crashed"},
      {"merge", "2 usage, or parts that cannot be read or do not belong together"},
      {"plugins", "2 usage, or no initializer is there, 3 the one that --describe names"},
      {"check-plugin", "1 a check failed"}};
  for (const auto& [command, words] : codes) {
    const std::string help = runEtalon({command, "--help"}).out;
    EXPECT_THAT(help, HasSubstr(words)) << command;
    EXPECT_EQ(help.find("never initialized") != std::string::npos, command == "replay") << command;
  }
}

TEST(Usage, BenchSaysThatAutoIsForReplay) {
  const CommandResult result = runEtalon({"bench", "/no/such/recording", "--initializers", "auto"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("'auto' is for replay alone"));
}

TEST(Usage, WhatIsAskedForTwiceIsRefused) {
  const CommandResult bench =
      runEtalon({"bench", "/no/such/recording", "--keyframes", "5,5", "--rate", "4,4"});
  EXPECT_EQ(bench.exit_code, 2);
  EXPECT_THAT(bench.err, HasSubstr("windows of 5 keyframes at 4 Hz are asked for twice"));
  const CommandResult trial = runEtalon({"trial", "/no/such/recording", "--from", "3,3"});
  EXPECT_EQ(trial.exit_code, 2);
  EXPECT_THAT(trial.err, HasSubstr("two instants (--from) are called '3 s'"));
  const TemporaryFolder folder;
  const CommandResult calibrate = runEtalon({"calibrate-device", "/no/such/recording",
                                             "/no/such/recording/", "--out", folder.path() + "/d"});
  EXPECT_EQ(calibrate.exit_code, 2);
  EXPECT_THAT(calibrate.err, HasSubstr("two recordings are called 'recording'"));
}

TEST(Usage, AToleranceIsInMilliseconds) {
  const CommandResult result = runEtalon({"info", "/no/such/recording", "--pair-tolerance", "-1"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("expected a number of milliseconds"));
}

TEST(Usage, CalibrateDeviceChecksItsOutputFirst) {
  const CommandResult result =
      runEtalon({"calibrate-device", "/no/such/recording", "--out", "/no/such/folder/device.ini"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("/no/such/folder/device.ini"));
}

TEST(Usage, OneGroundTruthBelongsToOneRecording) {
  for (const char* command : {"ground-truth", "bench", "trial"}) {
    const CommandResult result =
        runEtalon({command, "a", "b", "--ground-truth", "/no/such/file", "--out", "out"});
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_THAT(result.err, HasSubstr("expected a folder with one for each of the 2")) << command;
  }
}

TEST(Usage, RefusesAnOptionInPlaceOfAPath) {
  const std::vector<std::vector<std::string>> wrong = {{"bench", "."},
                                                       {"merge", "."},
                                                       {"calibrate-device", "."},
                                                       {"replay", "."},
                                                       {"ground-truth", "."}};
  for (std::vector<std::string> arguments : wrong) {
    arguments.insert(arguments.end(), {"--out", "--help"});
    const CommandResult result = runEtalon(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    EXPECT_THAT(result.err, HasSubstr("expected a path, found '--help'")) << arguments.front();
  }
}

TEST(Usage, PrintsItsVersion) {
  const CommandResult result = runEtalon({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, ::testing::ContainsRegex("[0-9]+\\.[0-9]+\\.[0-9]+"));
}

TEST(Usage, RefusesAnUnknownCommandWithTheNearest) {
  const CommandResult nonsense = runEtalon({"nonsense"});
  EXPECT_EQ(nonsense.exit_code, 2);
  EXPECT_THAT(nonsense.err, AllOf(HasSubstr("no command 'nonsense'"), HasSubstr("expected one of"),
                                  HasSubstr("plugins")));
  EXPECT_THAT(runEtalon({"plugin"}).err, HasSubstr("did you mean 'plugins'?"));
}

TEST(Usage, RefusesUnknownOptionsAndMissingArguments) {
  const std::vector<std::vector<std::string>> wrong = {
      {"--nonsense"}, {"plugins", "--nonsense"},   {"plugins", "extra"}, {"plugins", "--describe"},
      {"info"},       {"convert", "only_a_source"}};
  for (const auto& arguments : wrong) {
    const CommandResult result = runEtalon(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.back();
    EXPECT_THAT(result.err, AllOf(HasSubstr("etalon: "), HasSubstr("--help"))) << arguments.back();
  }
}

TEST(Usage, RefusesASourceThatIsNotThere) {
  const CommandResult result = runEtalon({"info", "/no/such/recording"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("/no/such/recording"));
}

}  // namespace
}  // namespace etalon::testing
