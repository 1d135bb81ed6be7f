#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
    for (const char* word : {"plugins", "info", "convert", "replay", "Exit codes"}) {
      EXPECT_THAT(result.out, HasSubstr(word));
    }
  }
}

TEST(Usage, EveryCommandHasHelp) {
  for (const char* command : {"info", "convert", "simulate", "replay", "plugins"}) {
    const CommandResult result = runEtalon({command, "--help"});
    EXPECT_EQ(result.exit_code, 0) << command;
    EXPECT_THAT(result.out, HasSubstr(std::string("Usage: etalon ") + command));
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
