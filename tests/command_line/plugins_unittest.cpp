#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/ini_file.h"
#include "etalon/pipeline/run_configuration.h"
#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string folder(const std::string& name) { return ETALON_TEST_INITIALIZERS "/" + name; }

TEST(PluginsCommand, ListsTheInitializersOfTheBuild) {
  const CommandResult result = runEtalon({"plugins"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("eta "), HasSubstr("orbslam3_inertial_only "),
                                HasSubstr("/eta.so"), Not(HasSubstr("Not usable"))));
}

TEST(PluginsCommand, ListsWhatCannotBeUsedWithReasons) {
  std::vector<std::string> arguments = {"plugins"};
  for (const char* name : {"good", "wrong_abi", "no_descriptor", "undefined_symbol", "same_name",
                           "wrong_base", "same_class"}) {
    arguments.push_back("--plugin-path");
    arguments.push_back(folder(name));
  }
  const CommandResult result = runEtalon(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("does as it is told"), HasSubstr("version 999"),
                                HasSubstr("etalon_initializer_descriptor"),
                                HasSubstr("functionThatNobodyDefines"), HasSubstr("found first"),
                                HasSubstr("does not derive"), HasSubstr("rename")));
}

TEST(PluginsCommand, DescribesParameters) {
  const CommandResult result = runEtalon({"plugins", "--describe", "eta"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("etalon::plugins::Eta"), HasSubstr("[eta]"),
                                HasSubstr("landmarks = fixed   (choice, fixed, free)")));
}

TEST(PluginsCommand, PrintsIniSectionsThatCanBeRead) {
  const CommandResult one = runEtalon({"plugins", "--describe", "eta", "--ini"});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(IniFile::fromText(one.out, "one").sections(), std::vector<std::string>{"eta"});
  const CommandResult all = runEtalon({"plugins", "--ini"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_GE(IniFile::fromText(all.out, "all").sections().size(), 2U);
}

/** Each section's text, with its documentation. */
std::map<std::string, std::string> sectionsOf(std::istream&& lines) {
  std::map<std::string, std::string> sections;
  std::string line, section;
  while (std::getline(lines, line)) {
    if (!line.empty() && line[0] == '[') section = line;
    if (!section.empty() && !line.empty()) sections[section] += line + "\n";
  }
  return sections;
}

/** config/euroc.ini says that it has every section and key with its documentation and default. */
TEST(ShippedConfiguration, SaysWhatTheProgramSays) {
  const SuiteConfiguration built_in = loadSuiteConfiguration(IniFile::fromText("", ""), {}, {});
  std::string text = built_in.pipeline_ini;
  for (const ConfiguredInitializer& one : built_in.initializers) text += one.ini;
  const auto shipped = sectionsOf(std::ifstream(ETALON_CONFIG "/euroc.ini"));
  const auto expected = sectionsOf(std::istringstream(text));
  EXPECT_EQ(shipped.size(), expected.size());
  for (const auto& [section, documentation] : expected) {
    ASSERT_TRUE(shipped.count(section)) << section;
    EXPECT_EQ(shipped.at(section), documentation);
  }
}

TEST(PluginsCommand, RefusesAnUnknownNameWithTheNearest) {
  const CommandResult result = runEtalon({"plugins", "--describe", "etta"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("etta"), HasSubstr("did you mean 'eta'?")));
  const CommandResult nope = runEtalon({"plugins", "--describe", "nope"});
  EXPECT_EQ(nope.exit_code, 3);
  EXPECT_THAT(nope.err, AllOf(HasSubstr("nope"), HasSubstr("available: "), HasSubstr("eta, ")));
}

TEST(PluginsCommand, RefusesBrokenLibrariesInWords) {
  const TemporaryFolder temporary;
  const std::string text = temporary.write("text.so", "not a library\n");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {text, "not a shared library"},
      {"/no/such/plugin.so", "no such file"},
      {folder("wrong_abi") + "/wrong_abi.so", "version 999"},
      {folder("undefined_symbol") + "/undefined_symbol.so", "functionThatNobodyDefines"},
      {folder("no_descriptor") + "/no_descriptor.so", "is no initializer plugin"},
      {folder("lying_base") + "/lying_base.so", "does not derive"},
      {folder("throws_when_made") + "/throws_when_made.so", "no licence found"}};
  for (const auto& [path, reason] : cases) {
    const CommandResult result = runEtalon({"plugins", "--describe", path});
    EXPECT_EQ(result.exit_code, 3) << path;
    EXPECT_THAT(result.err, AllOf(HasSubstr(path), HasSubstr(reason)));
  }
}

TEST(PluginsCommand, RefusesASearchPathThatIsNotThere) {
  const CommandResult result = runEtalon({"plugins", "--plugin-path", "/no/such/folder"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("/no/such/folder"));
}

}  // namespace
}  // namespace etalon::testing
