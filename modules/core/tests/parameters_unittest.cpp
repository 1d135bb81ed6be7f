#include "etalon/core/parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/** What `action` throws as ConfigError, or a text that no expectation matches. */
template <typename Action>
std::string errorOf(Action action) {
  try {
    action();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "<nothing thrown>";
}

struct Options {
  double sigma_px = 1.0;
  int iterations = 10;
  bool free_landmarks = false;
  std::string folder = "out";
  std::string variant = "paper";

  ParameterSet parameters() {
    ParameterSet set("solver");
    set.add("sigma_px", &sigma_px, {0.1, 10.0}, "Standard deviation of a pixel coordinate.");
    set.add("iterations", &iterations, {1, 200}, "Iterations at most.");
    set.add("free_landmarks", &free_landmarks, "Whether landmarks move.");
    set.add("folder", &folder, "Where results go.");
    set.add("variant", &variant, std::vector<std::string>{"paper", "fusion"}, "Which recipe.");
    return set;
  }
};

std::string readError(const std::string& body) {
  Options options;
  return errorOf(
      [&] { options.parameters().read(IniFile::fromText("[solver]\n" + body + "\n", "a.ini")); });
}

Options readOptions(const std::string& body) {
  Options options;
  options.parameters().read(IniFile::fromText("[solver]\n" + body + "\n", "a.ini"));
  return options;
}

TEST(IniFile, ReadsSectionsKeysAndComments) {
  const IniFile ini = IniFile::fromText(
      "\xEF\xBB\xBF; comment\r\n# comment\n// comment\n\n[one]  ; trailing\r\n a = 1 // "
      "trailing\r\n"
      "url = http://host/path\nempty =\n[two]\nb.c = x = y\n",
      "a.ini");
  EXPECT_EQ(ini.sections(), (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(ini.section("one").at("a").text, "1");
  EXPECT_EQ(ini.section("one").at("a").origin, "a.ini:6");
  EXPECT_EQ(ini.section("one").at("url").text, "http://host/path");
  EXPECT_EQ(ini.section("one").at("empty").text, "");
  EXPECT_EQ(ini.section("two").at("b.c").text, "x = y");
  EXPECT_EQ(ini.sectionOrigin("two"), "a.ini:9");
  EXPECT_TRUE(ini.section("three").empty());
}

TEST(IniFile, RefusesMissingFileFolderAndBinary) {
  EXPECT_THAT(errorOf([] { IniFile::fromFile("/no/such/file.ini"); }),
              AllOf(HasSubstr("/no/such/file.ini"), HasSubstr("no such file")));
  EXPECT_THAT(errorOf([] { IniFile::fromFile("/"); }), HasSubstr("folder"));
  EXPECT_THAT(errorOf([] { IniFile::fromText(std::string("[a]\nb=\0\n", 8), "a.ini"); }),
              HasSubstr("text file"));
}

TEST(IniFile, RefusesMalformedLinesNamingTheLine) {
  const auto error = [](const std::string& text) {
    return errorOf([&] { IniFile::fromText(text, "a.ini"); });
  };
  EXPECT_THAT(error("[a]\n\njust words\n"), AllOf(HasSubstr("a.ini:3"), HasSubstr("just words")));
  EXPECT_THAT(error("a = 1\n"), AllOf(HasSubstr("a.ini:1"), HasSubstr("before the first section")));
  EXPECT_THAT(error("[a\nb = 1\n"), AllOf(HasSubstr("a.ini:1"), HasSubstr("closing")));
  EXPECT_THAT(error("[a] b\n"), AllOf(HasSubstr("a.ini:1"), HasSubstr("end of the line")));
  EXPECT_THAT(error("[]\n"), HasSubstr("section name"));
  EXPECT_THAT(error("[a]\n= 1\n"), AllOf(HasSubstr("a.ini:2"), HasSubstr("key")));
  EXPECT_THAT(error("[a]\nb c = 1\n"), AllOf(HasSubstr("a.ini:2"), HasSubstr("'b c'")));
}

TEST(IniFile, RefusesDuplicateKeysAlsoInRepeatedSectionsAndOtherCase) {
  const auto error = [](const std::string& text) {
    return errorOf([&] { IniFile::fromText(text, "a.ini"); });
  };
  EXPECT_THAT(error("[a]\nb = 1\nb = 2\n"),
              AllOf(HasSubstr("a.ini:3"), HasSubstr("once"), HasSubstr("a.ini:2")));
  EXPECT_THAT(error("[a]\nb = 1\n[c]\n[a]\nb = 1\n"), HasSubstr("a.ini:5"));
  EXPECT_THAT(error("[a]\nb = 1\nB = 2\n"), HasSubstr("a.ini:3"));
}

TEST(IniFile, RefusesWhatMrptWouldExpandOrJoin) {
  const auto error = [](const std::string& text) {
    return errorOf([&] { IniFile::fromText(text, "a.ini"); });
  };
  EXPECT_THAT(error("[a]\nb = $env{HOME}\n"), HasSubstr("a.ini"));
  EXPECT_THAT(error("[a]\nb = $eval{1+1}\n"), HasSubstr("a.ini"));
  EXPECT_THAT(error("@define V 3\n[a]\nb = ${V}\n"), HasSubstr("a.ini:1"));
  EXPECT_THAT(error("[a]\nb = 1 \\\nc = 2\n"), HasSubstr("a.ini:2"));
}

TEST(IniFile, TakesOverridesFromTheCommandLine) {
  IniFile ini = IniFile::fromText("[a]\nb = 1\n", "a.ini");
  ini.setFromArgument("a.b=2");
  ini.setFromArgument("new.key=x=y z");
  EXPECT_EQ(ini.section("a").at("b").text, "2");
  EXPECT_EQ(ini.section("a").at("b").origin, "--set");
  EXPECT_EQ(ini.section("new").at("key").text, "x=y z");
  for (const char* wrong : {"", "a", "a.b", "a=1", "=1", ".b=1", "a.=1", "a b.c=1", "a.b=1\nc=2",
                            "a.b=$env{HOME}", "a.b=x // y"}) {
    EXPECT_THAT(errorOf([&] { ini.setFromArgument(wrong); }), HasSubstr("--set")) << wrong;
  }
}

TEST(ParameterSet, ReadsEveryTypeAndKeepsDefaults) {
  const Options options = readOptions(
      "sigma_px = +2.5e-1\niterations = 7\nfree_landmarks = On\nfolder = a b\nvariant = fusion");
  EXPECT_EQ(options.sigma_px, 0.25);
  EXPECT_EQ(options.iterations, 7);
  EXPECT_TRUE(options.free_landmarks);
  EXPECT_EQ(options.folder, "a b");
  EXPECT_EQ(options.variant, "fusion");
  const Options untouched = readOptions("");
  EXPECT_EQ(untouched.sigma_px, 1.0);
  EXPECT_EQ(untouched.variant, "paper");
}

TEST(ParameterSet, ReadsAllFormsOfBooleans) {
  for (const char* text : {"true", "yes", "on", "1", "TRUE", "Yes"}) {
    EXPECT_TRUE(readOptions(std::string("free_landmarks = ") + text).free_landmarks) << text;
  }
  for (const char* text : {"false", "no", "off", "0", "FALSE", "Off"}) {
    EXPECT_FALSE(readOptions(std::string("free_landmarks = ") + text).free_landmarks) << text;
  }
  for (const char* text : {"", "2", "y", "tru", "true;"}) {
    EXPECT_THAT(readError(std::string("free_landmarks = ") + text), HasSubstr("true or false"))
        << text;
  }
}

TEST(ParameterSet, RefusesNumbersThatAreNotWholeFiniteOrInRange) {
  for (const char* text : {"", "abc", "1,5", "1.5x", "1 2", "nan", "inf", "-inf", "1e999", "0x10",
                           "--1", "+-1", "1 ; comment", "0.05", "10.5", "-1"}) {
    EXPECT_THAT(readError(std::string("sigma_px = ") + text),
                AllOf(HasSubstr("a.ini:2: [solver] sigma_px = '" + std::string(text) + "'"),
                      HasSubstr("expected a finite number, 0.1 to 10")));
  }
  for (const char* text : {"", "1.0", "1e2", "ten", "0", "201", "99999999999999999999"}) {
    EXPECT_THAT(readError(std::string("iterations = ") + text),
                AllOf(HasSubstr("a.ini:2: [solver] iterations"),
                      HasSubstr("expected an integer, 1 to 200")));
  }
}

TEST(ParameterSet, RefusesUnknownKeysAndChoicesNamingTheNearest) {
  EXPECT_THAT(readError("sigm_px = 1"), AllOf(HasSubstr("a.ini:2: [solver] sigm_px = '1'"),
                                              HasSubstr("did you mean 'sigma_px'?")));
  EXPECT_THAT(readError("zzz = 1"), AllOf(HasSubstr("known: sigma_px, iterations")));
  EXPECT_THAT(readError("variant = papr"),
              AllOf(HasSubstr("one of paper, fusion"), HasSubstr("did you mean 'paper'?")));
}

TEST(ParameterSet, TakesTheBeginningOfOneKeyForItButNotOfTwo) {
  int all = 0, some = 0;
  ParameterSet set("solver");
  set.add("prior_gyro_information", &all, {0, 9}, "");
  set.add("window_first_keyframe", &some, {0, 9}, "");
  set.add("window_last_keyframe", &some, {0, 9}, "");
  const auto message = [&set](const std::string& line) {
    return errorOf([&] { set.read(IniFile::fromText("[solver]\n" + line + "\n", "a.ini")); });
  };
  EXPECT_THAT(message("prior_gyro = 1"), HasSubstr("did you mean 'prior_gyro_information'?"));
  EXPECT_THAT(message("window_ = 1"), HasSubstr("known: "));
  EXPECT_THAT(message("pri = 1"), HasSubstr("known: "));
}

TEST(ParameterSet, SaysThatACommentNeedsALineOfItsOwn) {
  EXPECT_THAT(readError("iterations = 10 ; many"), HasSubstr("';' needs a line of its own"));
  EXPECT_THAT(readError("iterations = 10 # many"), HasSubstr("'#' needs a line of its own"));
  EXPECT_THAT(readError("iterations = x"), Not(HasSubstr("line of its own")));
}

TEST(ParameterSet, ReadsNumbersAlikeInEveryLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* locale : {"de_DE.UTF-8", "fr_FR.UTF-8"}) {  // decimal comma, where installed
    std::setlocale(LC_ALL, locale);
    EXPECT_EQ(readOptions("sigma_px = 2.5").sigma_px, 2.5);
    Options options;
    options.sigma_px = 2.5;
    EXPECT_THAT(options.parameters().toIni(), HasSubstr("sigma_px = 2.5\n"));
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST(ParameterSet, WritesWhatItReadsBackIdentically) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-300.0, 300.0);
  for (int i = 0; i < 1000; ++i) {
    const double value =
        std::ldexp(std::generate_canonical<double, 53>(random), static_cast<int>(exponent(random)));
    double written = value;
    double read = 0.0;
    ParameterSet out("s"), in("s");
    out.add("x", &written, {}, "A number.");
    in.add("x", &read, {}, "A number.");
    in.read(IniFile::fromText(out.toIni(), "out.ini"));
    ASSERT_EQ(read, value);
  }
  Options options;
  options.iterations = 42;
  options.free_landmarks = true;
  options.folder = "";
  options.variant = "fusion";
  Options read_back;
  read_back.parameters().read(IniFile::fromText(options.parameters().toIni(), "out.ini"));
  EXPECT_EQ(read_back.iterations, 42);
  EXPECT_TRUE(read_back.free_landmarks);
  EXPECT_EQ(read_back.folder, "");
  EXPECT_EQ(read_back.variant, "fusion");
}

TEST(ParameterSet, WrapsDocumentationAtHundredColumns) {
  double x = 1.0;
  ParameterSet set("s");
  std::string doc;
  for (int i = 0; i < 60; ++i) doc += "word" + std::to_string(i) + " ";
  set.add("x", &x, {}, doc);
  std::istringstream lines(set.toIni());
  int comments = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100U) << line;
    comments += line.rfind("; ", 0) == 0 ? 1 : 0;
  }
  EXPECT_GE(comments,
            5);  // 60 words of 7 letters in lines of 100, and the line of type and default
}

TEST(ParameterSet, DescribesItself) {
  Options options;
  const auto descriptions = options.parameters().describe();
  ASSERT_EQ(descriptions.size(), 5U);
  EXPECT_EQ(descriptions[0].key, "sigma_px");
  EXPECT_EQ(descriptions[0].type, "number");
  EXPECT_EQ(descriptions[0].default_value, "1");
  EXPECT_EQ(descriptions[0].range, "0.1 to 10");
  EXPECT_EQ(descriptions[4].range, "paper, fusion");
}

TEST(ParameterSet, AnEnumHasTheNamesOfItsValues) {
  enum class Recipe { kPaper, kFusion };
  Recipe recipe = Recipe::kPaper;
  bool free = true;
  ParameterSet set("s");
  set.add("recipe", &recipe, {{"paper", Recipe::kPaper}, {"fusion", Recipe::kFusion}}, "Which.");
  set.add("landmarks", &free, {{"fixed", false}, {"free", true}}, "Whether landmarks move.");
  const auto descriptions = set.describe();
  EXPECT_EQ(descriptions[0].type, "choice");
  EXPECT_EQ(descriptions[0].range, "paper, fusion");
  EXPECT_EQ(descriptions[0].default_value, "paper");
  EXPECT_EQ(descriptions[1].default_value, "free");
  const auto read = [&set](const std::string& lines) {
    set.read(IniFile::fromText("[s]\n" + lines, "a.ini"));
  };
  read("recipe = fusion\nlandmarks = fixed\n");
  EXPECT_EQ(recipe, Recipe::kFusion);
  EXPECT_FALSE(free);
  EXPECT_THAT(set.toIni(), AllOf(HasSubstr("recipe = fusion"), HasSubstr("landmarks = fixed")));
  EXPECT_THAT(errorOf([&] { read("recipe = fusio\n"); }),
              AllOf(HasSubstr("one of paper, fusion"), HasSubstr("did you mean 'fusion'?")));
  Recipe unnamed = Recipe::kFusion;
  EXPECT_THAT(errorOf([&] {
                set.add("r", &unnamed, {{"paper", Recipe::kPaper}}, "");
              }),
              HasSubstr("none of its choices"));
}

TEST(ParameterSet, RefusesWrongDeclarations) {
  double x = std::numeric_limits<double>::quiet_NaN();
  std::string choice = "none";
  ParameterSet set("s");
  EXPECT_THAT(errorOf([&] { set.add("x", &x, {0.0, 1.0}, ""); }), HasSubstr("outside its range"));
  EXPECT_THAT(errorOf([&] { set.add("c", &choice, std::vector<std::string>{"a"}, ""); }),
              HasSubstr("none of its choices"));
  x = 0.5;
  set.add("x", &x, {0.0, 1.0}, "");
  EXPECT_THAT(errorOf([&] { set.add("x", &x, {0.0, 1.0}, ""); }), HasSubstr("declared twice"));
}

TEST(ParameterSet, SurvivesBeingMoved) {
  double x = 0.0;
  auto make = [&x] {
    ParameterSet set("a_section_whose_name_is_longer_than_the_small_string");
    set.add("x", &x, {}, "A number.");
    return set;
  };
  ParameterSet moved("other");
  moved = make();
  EXPECT_THAT(errorOf([&] {
                IniFile ini;
                ini.set("a_section_whose_name_is_longer_than_the_small_string", "x", "y", "--set");
                moved.read(ini);
              }),
              HasSubstr("[a_section_whose_name_is_longer_than_the_small_string] x = 'y'"));
}

TEST(CheckSections, NamesTheUnknownAndTheNearest) {
  const IniFile ini = IniFile::fromText("[imu]\n[fronted]\n", "a.ini");
  EXPECT_NO_THROW(checkSections(ini, {"imu", "fronted"}));
  EXPECT_THAT(errorOf([&] {
                checkSections(ini, {"imu", "frontend"});
              }),
              AllOf(HasSubstr("a.ini:2: [fronted]"), HasSubstr("did you mean 'frontend'?")));
}

TEST(NearestWord, FindsMisspellingsAndForgottenSyllables) {
  const std::vector<std::string> words{"gyro_noise_factor", "accel_noise_factor", "eta"};
  EXPECT_EQ(nearestWord("gyro_factor", words), "gyro_noise_factor");
  EXPECT_EQ(nearestWord("acel_nosie_factor", words), "accel_noise_factor");
  EXPECT_EQ(nearestWord("eat", words), "eta");
  EXPECT_EQ(nearestWord("nope", words), "");
  EXPECT_EQ(nearestWord("x", {}), "");
}

}  // namespace
}  // namespace etalon
