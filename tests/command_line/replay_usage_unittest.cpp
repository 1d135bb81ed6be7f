#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A recording that is not there: configuration is read first, so that exit code 2 shows that the
// mistake was found before any data was looked at, and 3 that there was none.
constexpr char kNoSource[] = "/no/such/recording";

/** Replays with these words after the source. */
CommandResult replay(const std::vector<std::string>& words) {
  std::vector<std::string> arguments = {"replay", kNoSource};
  arguments.insert(arguments.end(), words.begin(), words.end());
  return runEtalon(arguments);
}

struct WrongWords {
  std::vector<std::string> words;
  std::vector<std::string> expected;  ///< all of it in the message
};

void expectRefused(const WrongWords& wrong) {
  const CommandResult result = replay(wrong.words);
  EXPECT_EQ(result.exit_code, 2) << wrong.words.back();
  EXPECT_THAT(result.out, IsEmpty());
  for (const std::string& text : wrong.expected) EXPECT_THAT(result.err, HasSubstr(text));
}

TEST(ReplayUsage, SaysFileLineSectionKeyAndValueOfAWrongConfiguration) {
  struct WrongFile {
    std::string content, line, expected;
  };
  const std::vector<WrongFile> wrong = {
      {"[pipeline]\nkeyframs = 10\n",
       ":2: ", "[pipeline] keyframs = '10': expected a known key (did you mean 'keyframes'?)"},
      {"; of mine\n\n[pipelin]\nkeyframes = 10\n",
       ":3: ", "[pipelin]: expected a known section (did you mean 'pipeline'?)"},
      {"[pipeline]\nkeyframes = ten\n",
       ":2: ", "[pipeline] keyframes = 'ten': expected an integer, 2 to 200"},
      {"[pipeline]\nkeyframes = 1\n",
       ":2: ", "[pipeline] keyframes = '1': expected an integer, 2 to 200"},
      {"[pipeline]\nkeyframe_rate_hz = 4,5\n",
       ":2: ", "[pipeline] keyframe_rate_hz = '4,5': expected a finite number"},
      {"[eta]\n\nlandmarks = fixd\n", ":3: ", "[eta] landmarks = 'fixd': expected one of fixed"},
      {"[eta]\nlandmark = fixed\n", ":2: ", "did you mean 'landmarks'?"},
      {"[eta]\nprior_gyro = 1\n", ":2: ", "did you mean 'prior_gyro_information'?"},
      {"[pipeline]\nkeyframes = 10 ; of mine\n",
       ":2: ", "with ' //', one with ';' needs a line of its own"},
      // Also of the plugin that is not chosen.
      {"[orbslam3_inertial_only]\nnonsense = 1\n", ":2: ", "nonsense = '1': expected a known key"},
      {"[pipeline]\nkeyframes = 10\nkeyframes = 11\n", ":3: ", "expected each key once"},
      {"[pipeline]\nkeyframes\n", ":2: ", "'keyframes': expected a [section], `key = value`"},
      {"keyframes = 10\n", ":1: ", "before the first section"},
      {"[pipeline\n", ":1: ", "no closing ']'"},
      {"[pipeline]\ninitializer = etta\n", ":2: ",
       "[pipeline] initializer = 'etta': no initializer is called 'etta' (did you mean 'eta'?)"},
      {"[pipeline]\ninitializer = auto\n[auto]\nat_rest = statik\n",
       ":4: ", "[auto] at_rest = 'statik': no initializer"},
      {"[frontend]\nklt_window_px = 10\n", ":2: ", "klt_window_px = '10': expected an odd integer"},
      {"[frontend]\nanchor_window_px = 16\n", ":2: ", "expected an odd integer"},
      {"[pipeline]\n\xEF\xBB\xBFkeyframes = 10\n", ":2: ", "key '\\ufeffkeyframes'"}};
  const TemporaryFolder folder;
  for (const WrongFile& file : wrong) {
    const std::string path = folder.write("wrong.ini", file.content);
    expectRefused({{"-c", path}, {path + file.line, file.expected}});
  }
}

TEST(ReplayUsage, RefusesAConfigurationThatIsNoFile) {
  const TemporaryFolder folder;
  expectRefused({{"-c", "/no/such.ini"}, {"--config", "/no/such.ini"}});
  expectRefused({{"-c", folder.path()}, {"--config", folder.path()}});
}

TEST(ReplayUsage, RefusesWrongSettings) {
  const std::vector<WrongWords> wrong = {
      {{"--set", "pipeline.keyframes"}, {"--set: 'pipeline.keyframes'", "section.key=value"}},
      {{"--set", "keyframes=3"}, {"--set: 'keyframes=3'", "section.key=value"}},
      {{"--set", "pipeline.=3"}, {"section.key=value"}},
      {{"--set", ".keyframes=3"}, {"section.key=value"}},
      {{"--set", "="}, {"section.key=value"}},
      {{"--set", ""}, {"section.key=value"}},
      {{"--set"}, {"--set"}},
      {{"--set", "pipeline.keyframes="}, {"keyframes = ''", "an integer, 2 to 200"}},
      {{"--set", "pipeline.keyframes=1e1"}, {"keyframes = '1e1'", "an integer, 2 to 200"}},
      {{"--set", "pipeline.keyframes=201"}, {"keyframes = '201'", "an integer, 2 to 200"}},
      {{"--set", "pipeline.keyframe_rate_hz=nan"}, {"keyframe_rate_hz = 'nan'", "finite"}},
      {{"--set", "pipeline.keyframe_rate_hz=-4"}, {"keyframe_rate_hz = '-4'", "0.1 to 100"}},
      {{"--set", "pipeline.keyframe=10"}, {"did you mean 'keyframes'?"}},
      {{"--set", "eeta.landmarks=free"}, {"[eeta]", "did you mean 'eta'?"}},
      {{"--set", "pipeline.keyframes=12", "--set", "eta.landmarks=fre"},
       {"landmarks = 'fre'", "did you mean 'free'?"}},
      {{"--set", "auto.moving=nope"}, {"--set: [auto] moving = 'nope': no initializer"}},
      {{"--set", "frontend.flight_features=500"},
       {"flight_features = '500': expected at most max_features, 250"}}};
  for (const WrongWords& words : wrong) expectRefused(words);
}

TEST(ReplayUsage, TheLastSettingWinsOverFileAndEarlierOnes) {
  const TemporaryFolder folder;
  const std::string path = folder.write("good.ini", "[pipeline]\nkeyframes = 12\n");
  const CommandResult good = replay({"-c", path, "--set", "pipeline.keyframes=8"});
  EXPECT_EQ(good.exit_code, 3) << good.err;  // nothing is wrong but the source
  EXPECT_THAT(good.err, AllOf(HasSubstr(kNoSource), Not(HasSubstr("keyframes"))));
  expectRefused({{"-c", path, "--set", "pipeline.keyframes=8", "--set", "pipeline.keyframes=0"},
                 {"keyframes = '0'"}});
}

TEST(ReplayUsage, RefusesAnUnknownInitializerWithTheNearest) {
  expectRefused({{"--initializer", "etta"}, {"'etta'", "did you mean 'eta'?"}});
  expectRefused({{"--set", "pipeline.initializer=orbslam3_inertial"},
                 {"'orbslam3_inertial'", "did you mean 'orbslam3_inertial_only'?"}});
  expectRefused({{"--initializer", "nothing_alike"},
                 {"'nothing_alike'", "available: ", "eta, ", "orbslam3_inertial_only"}});
  expectRefused({{"--initializer", ""}, {"available: ", "eta, "}});
  expectRefused(
      {{"--initializer", "auto", "--set", "auto.at_rest=etalon"}, {"[auto]", "'etalon'"}});
  expectRefused(
      {{"--initializer", "auto", "--set", "auto.moving=etta"}, {"'etta'", "did you mean 'eta'?"}});
}

TEST(ReplayUsage, RefusesPluginsThatCannotBeLoaded) {
  const TemporaryFolder folder;
  const std::string text = folder.write("text.so", "not a library\n");
  const std::string tests = ETALON_TEST_INITIALIZERS;
  expectRefused({{"--plugin-path", "/no/such/folder"}, {"--plugin-path", "/no/such/folder"}});
  expectRefused(
      {{"--set", "plugins.path=/no/such/folder"}, {"--set", "[plugins] path", "/no/such/folder"}});
  expectRefused({{"--initializer", text}, {text, "not a shared library"}});
  expectRefused({{"--initializer", "/no/such/plugin.so"}, {"/no/such/plugin.so", "no such file"}});
  expectRefused({{"--plugin-path", tests + "/wrong_abi", "--initializer", "wrong_abi"},
                 {"wrong_abi", "version 999"}});
  expectRefused({{"--initializer", tests + "/undefined_symbol/undefined_symbol.so"},
                 {"functionThatNobodyDefines"}});
}

TEST(ReplayUsage, RefusesAnOptionInPlaceOfAFolder) {
  expectRefused({{"--out", "--help"}, {"--out", "expected a path, found '--help'"}});
}

TEST(ReplayUsage, RefusesAWindowWithoutADisplay) {
  unsetenv("DISPLAY");  // the command inherits it
  expectRefused({{"--gui"}, {"--gui", "DISPLAY is not set"}});
  setenv("DISPLAY", ":3917", 1);
  expectRefused({{"--gui"}, {"--gui", "no X server answers at DISPLAY=:3917"}});
  unsetenv("DISPLAY");
}

TEST(ReplayUsage, NamesTheNearestOption) {
  expectRefused({{"--initalizer", "eta"}, {"--initalizer", "did you mean '--initializer'?"}});
  expectRefused({{"--final-ab"}, {"did you mean '--final-ba'?"}});
}

TEST(ReplayUsage, RefusesAFaultThatIsNone) {
  expectRefused({{"--fault", "coverd from=8"}, {"--fault", "did you mean 'covered'?"}});
  expectRefused({{"--fault", "covered form=8"}, {"--fault", "did you mean 'from'?"}});
  expectRefused({{"--fault-seed", "-1"}, {"--fault-seed", "whole number"}});
}

TEST(ReplayUsage, RefusesARangeThatIsNone) {
  const std::vector<WrongWords> wrong = {
      {{"--from", "3", "--to", "2"}, {"--from", "less than --to"}},
      {{"--from", "2", "--to", "2"}, {"--from", "less than --to"}},
      {{"--to", "-1"}, {"less than --to"}},
      {{"--to", "nan"}, {"--to", "'nan'"}},
      {{"--from", "-1"}, {"--from", "'-1'", "at least 0"}},
      {{"--from", "inf"}, {"--from", "'inf'", "at least 0"}},
      {{"--from", "soon"}, {"--from", "'soon'", "number of seconds"}}};
  for (const WrongWords& words : wrong) expectRefused(words);
}

}  // namespace
}  // namespace etalon::testing
