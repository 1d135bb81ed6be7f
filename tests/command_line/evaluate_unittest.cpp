#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kRadius = 2.0;

/** A circle at 20 Hz, level, moved by (dx, 0, 0) and enlarged about the origin. */
std::string circleTum(double dx, double scale = 1.0) {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int k = 0; k < 100; ++k) {
    char line[200];
    std::snprintf(line, sizeof line, "%d.%09d %.9f %.9f 1 0 0 0 1\n", 1400000000 + k / 20,
                  k % 20 * 50'000'000, scale * kRadius * std::cos(0.05 * k) + dx,
                  scale * kRadius * std::sin(0.05 * k));
    text += line;
  }
  return text;
}

/** The circle as EuRoC's ground truth, 2 ms later. */
std::string circleCsv() {
  std::string text = "#timestamp, p x y z, q w x y z\n";
  for (int k = 0; k < 100; ++k) {
    char line[200];
    std::snprintf(line, sizeof line, "%lld,%.9f,%.9f,1,1,0,0,0\n",
                  1'400'000'000'002'000'000LL + k * 50'000'000LL, kRadius * std::cos(0.05 * k),
                  kRadius * std::sin(0.05 * k));
    text += line;
  }
  return text;
}

TEST(EvaluateCommand, PrintsAbsoluteAndRelativeErrors) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", circleTum(0.0));
  const std::string moved = folder.write("moved.tum", circleTum(0.5));
  const CommandResult result = runEtalon({"evaluate", moved, truth});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* word : {"100 of 100 poses", "ATE", "none", "SE(3)", "Sim(3)", "yaw and position",
                           "RPE", "1 frame", "10 frames", "1 m", "500.000"})
    EXPECT_THAT(result.out, HasSubstr(word));
  EXPECT_THAT(result.out, Not(HasSubstr("mean")));
  EXPECT_THAT(runEtalon({"evaluate", moved, truth, "--verbose"}).out, HasSubstr("mean"));
  const CommandResult csv =
      runEtalon({"evaluate", moved, truth, "--align", "none", "--delta", "5", "--format", "csv"});
  EXPECT_THAT(csv.out, StartsWith("error,over,count,position_rmse_m,position_mean_m,"));
  EXPECT_THAT(csv.out, HasSubstr("\nATE,none,100,0.5,0.5,0.5,"));
  EXPECT_THAT(csv.out, HasSubstr("\nRPE,5 frames,19,"));
}

TEST(EvaluateCommand, TakesEurocsCsvAndAssociatesWithinTheLimit) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("data.csv", circleCsv());
  const std::string estimate = folder.write("estimate.tum", circleTum(0.0));
  const CommandResult result = runEtalon({"evaluate", estimate, truth, "--align", "none"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("100 of 100 poses"));
  const CommandResult apart =
      runEtalon({"evaluate", estimate, truth, "--max-time-difference", "0.001"});
  EXPECT_EQ(apart.exit_code, 3);
  EXPECT_THAT(apart.err, AllOf(HasSubstr(estimate), HasSubstr("0.001 s")));
  EXPECT_THAT(apart.out, IsEmpty());
}

/** The lines [first, last) of a file with one line of comment. */
std::string linesOf(const std::string& text, int first, int last) {
  std::istringstream in(text);
  std::string part, line;
  std::getline(in, line);
  for (int k = 0; std::getline(in, line); ++k)
    if (first <= k && k < last) part += line + "\n";
  return part;
}

TEST(EvaluateCommand, AsksForAMinimumOfGroundTruth) {
  const TemporaryFolder folder;
  const std::string estimate = folder.write("estimate.tum", circleTum(0.0));
  const std::string truth = folder.write("truth.tum", linesOf(circleTum(0.0), 40, 49));
  const CommandResult barely = runEtalon({"evaluate", estimate, truth});
  EXPECT_EQ(barely.exit_code, 3);
  EXPECT_THAT(barely.err, AllOf(HasSubstr("9 of 100 poses are covered"), HasSubstr("0.5 of them"),
                                HasSubstr("--min-coverage")));
  EXPECT_THAT(barely.out, IsEmpty());
  const CommandResult wanted = runEtalon({"evaluate", estimate, truth, "--min-coverage", "0.05"});
  EXPECT_EQ(wanted.exit_code, 0) << wanted.err;
  EXPECT_THAT(wanted.out, HasSubstr("covers 9 of them"));
  EXPECT_THAT(wanted.out, Not(HasSubstr("nan")));
  // One row aligns with anything, however little is asked for.
  const std::string row = folder.write("row.tum", linesOf(circleTum(0.0), 40, 41));
  EXPECT_EQ(runEtalon({"evaluate", estimate, row, "--min-coverage", "0"}).exit_code, 3);
  EXPECT_EQ(runEtalon({"evaluate", estimate, truth, "--min-coverage", "2"}).exit_code, 2);
}

TEST(EvaluateCommand, RefusesTooFewPosesAndAnEmptyGroundTruth) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", circleTum(0.0));
  const std::string two = folder.write("two.tum", linesOf(circleTum(0.0), 40, 42));
  const CommandResult few = runEtalon({"evaluate", two, truth, "--min-coverage", "0"});
  EXPECT_EQ(few.exit_code, 3);
  EXPECT_THAT(few.err, AllOf(HasSubstr(two), HasSubstr("expected at least 3 poses, found 2")));
  for (const char* text : {"", "# t x y z qx qy qz qw\n"}) {
    const std::string empty = folder.write("empty.tum", text);
    const CommandResult result = runEtalon({"evaluate", truth, empty});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr(empty + ": has no pose"));
  }
}

TEST(EvaluateCommand, SaysThatNoTwoPosesAreSoFarApart) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", circleTum(0.0));
  const CommandResult result =
      runEtalon({"evaluate", truth, truth, "--delta", "500", "--format", "csv"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("no two poses are 500 frames apart"));
}

/** Along a line at a speed that changes, at 100 Hz, `late_s` late. */
std::string lineTum(double late_s) {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int k = 0; k < 1000; ++k) {
    const double s = 0.01 * k - late_s;
    char line[200];
    std::snprintf(line, sizeof line, "%d.%09d %.9f 2 1 0 0 0 1\n", 1400000000 + k / 100,
                  k % 100 * 10'000'000, s + std::sin(s));
    text += line;
  }
  return text;
}

TEST(EvaluateCommand, TheTimeShiftIsBesideATableForPeopleAndApartFromOneForPrograms) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", lineTum(0.02));
  const std::string estimate = folder.write("estimate.tum", lineTum(0.0));
  const std::string words = "ground truth is 20.0";
  for (const char* format : {"text", "markdown"}) {
    const CommandResult people =
        runEtalon({"evaluate", estimate, truth, "--estimate-offset", "--format", format});
    EXPECT_EQ(people.exit_code, 0) << people.err;
    EXPECT_THAT(people.out, AllOf(HasSubstr(words), HasSubstr(" ms late; ATE aligned in SE(3) ")));
    EXPECT_THAT(people.err, IsEmpty());
  }
  const CommandResult programs =
      runEtalon({"evaluate", estimate, truth, "--estimate-offset", "--format", "csv"});
  EXPECT_EQ(programs.exit_code, 0);
  EXPECT_THAT(programs.err, HasSubstr(words));
  EXPECT_EQ(programs.out, runEtalon({"evaluate", estimate, truth, "--format", "csv"}).out);
  // A circle at a constant speed is the same circle a little later.
  const std::string circle = folder.write("circle.tum", circleTum(0.0));
  const CommandResult refused = runEtalon({"evaluate", circle, circle, "--estimate-offset"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("no time shift: the motion is too even"));
}

TEST(EvaluateCommand, DrawsAPlot) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", circleTum(0.0));
  const std::string plot = folder.path() + "/plot.png";
  EXPECT_EQ(runEtalon({"evaluate", truth, truth, "--plot", plot}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(plot));
}

TEST(EvaluateCommand, RefusesWhatItCannotUse) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.tum", circleTum(0.0));
  const std::string words = folder.write("words.tum", "no trajectory\n");
  const std::vector<std::pair<std::vector<std::string>, int>> wrong = {
      {{"evaluate"}, 2},
      {{"evaluate", truth}, 2},
      {{"evaluate", truth, truth, "--align", "best"}, 2},
      {{"evaluate", truth, truth, "--delta", "0"}, 2},
      {{"evaluate", truth, truth, "--delta", "1.5"}, 2},
      {{"evaluate", truth, truth, "--unit", "meters"}, 2},
      {{"evaluate", truth, truth, "--delta", "1", "--unit", "miles"}, 2},
      {{"evaluate", truth, truth, "--max-time-difference", "-1"}, 2},
      {{"evaluate", "/no/such.tum", truth}, 3},
      {{"evaluate", truth, "/no/such.tum"}, 3},
      {{"evaluate", truth, folder.path()}, 3},
      {{"evaluate", words, truth}, 3}};
  for (const auto& [arguments, exit_code] : wrong) {
    const CommandResult result = runEtalon(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << arguments.back() << ": " << result.err;
    EXPECT_THAT(result.err, HasSubstr("etalon: "));
    EXPECT_THAT(result.out, IsEmpty());
  }
}

TEST(EvaluateCommand, SaysWhichFileIsMissing) {
  const TemporaryFolder folder;
  const std::string flown = folder.write("trajectory.tum", "0 0 0 0 0 0 0 1\n");
  const auto refusal = [](const std::vector<std::string>& words) {
    std::vector<std::string> arguments = {"evaluate"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    return runEtalon(arguments).err;
  };
  EXPECT_THAT(refusal({flown}), HasSubstr("expected a ground truth after the trajectory"));
  EXPECT_THAT(refusal({folder.path(), flown}),
              HasSubstr("is a folder; expected a TUM file, here " + flown));
  EXPECT_THAT(refusal({"/no/such.tum", flown}), HasSubstr("expected a TUM trajectory"));
}

}  // namespace
}  // namespace etalon::testing
