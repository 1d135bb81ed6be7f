#include "etalon/simulation/faults/fault_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string errorOf(const std::string& text) {
  try {
    parseFaultScenario("bad", text, "faults.ini:7");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FaultScenario, ReadsKindsAndKeys) {
  const FaultScenario scenario =
      parseFaultScenario("two", "covered lens=left from=8 for=1.5, bias_jump gyro_dps=0.3 from=-1");
  EXPECT_EQ(scenario.name, "two");
  ASSERT_EQ(scenario.faults.size(), 2u);
  const auto& covered = std::get<faults::Covered>(scenario.faults[0]);
  EXPECT_EQ(covered.lens, Lens::kLeft);
  EXPECT_EQ(covered.during.from_s, 8.0);
  EXPECT_EQ(covered.during.length_s, 1.5);
  const auto& jump = std::get<faults::BiasJump>(scenario.faults[1]);
  EXPECT_EQ(jump.gyro_dps, 0.3);
  EXPECT_EQ(jump.accel_mps2, 0.0);
  EXPECT_FALSE(jump.during.contains(-1.1));
  EXPECT_TRUE(jump.during.contains(1e6));
}

TEST(FaultScenario, NothingIsAScenario) {
  EXPECT_TRUE(parseFaultScenario("none", "").faults.empty());
  EXPECT_TRUE(parseFaultScenario("none", "  ").faults.empty());
}

TEST(FaultScenario, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(errorOf("coverd from=8"),
              AllOf(HasSubstr("faults.ini:7"), HasSubstr("bad"), HasSubstr("'coverd'"),
                    HasSubstr("expected a fault, one of covered, frozen"),
                    HasSubstr("did you mean 'covered'?")));
  EXPECT_THAT(errorOf("covered form=8"),
              AllOf(HasSubstr("faults.ini:7"), HasSubstr("bad.covered"), HasSubstr("form"),
                    HasSubstr("did you mean 'from'?")));
  EXPECT_THAT(errorOf("covered lens=lef"), HasSubstr("expected one of both, left, right"));
  EXPECT_THAT(errorOf("covered from=8 for=soon"),
              AllOf(HasSubstr("for = 'soon'"), HasSubstr("expected a finite number")));
  EXPECT_THAT(errorOf("every n=0"), HasSubstr("expected an integer, 1 to 1000"));
  EXPECT_THAT(errorOf("covered from = 8"), HasSubstr("expected key=value without blanks"));
  EXPECT_THAT(errorOf("covered from=8 from=9"), HasSubstr("expected each key once"));
  EXPECT_THAT(errorOf("covered from=8,"), HasSubstr("expected a fault, one of"));
  EXPECT_THAT(errorOf("lost"), HasSubstr("lost: expected percent="));
  EXPECT_THAT(errorOf("calibration lens=left"),
              HasSubstr("expected rotation_deg=, or focal_percent=, or baseline_percent="));
  EXPECT_THAT(errorOf("clock_jump by=5 for=3"), HasSubstr("expected a known key"));
}

class FaultFile : public ::testing::Test {
 protected:
  std::string write(const std::string& text) const {
    std::string path = (folder_ / "faults.ini").string();
    std::ofstream(path) << text;
    return path;
  }
  std::string errorOf(const std::string& text) const {
    try {
      readFaultFile(write(text));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(FaultFile, KeepsItsOrder) {
  const auto scenarios = readFaultFile(
      write("; a comment\n[faults]\nzebra = every n=2\nnone =\n\nant = dropped for=1\n"));
  ASSERT_EQ(scenarios.size(), 3u);
  EXPECT_EQ(scenarios[0].name, "zebra");
  EXPECT_EQ(scenarios[0].text, "every n=2");
  EXPECT_EQ(scenarios[1].name, "none");
  EXPECT_EQ(scenarios[1].text, "");
  EXPECT_EQ(scenarios[2].name, "ant");
}

TEST_F(FaultFile, NamesFileAndLine) {
  EXPECT_THAT(errorOf("[faults]\nnone =\nlost = lost precent=3\n"),
              AllOf(HasSubstr("faults.ini:3: "), HasSubstr("did you mean 'percent'?")));
  EXPECT_THAT(errorOf("[fault]\nnone =\n"),
              AllOf(HasSubstr("faults.ini:1: "), HasSubstr("did you mean 'faults'?")));
  EXPECT_THAT(errorOf("; nothing\n"), HasSubstr("expected a section [faults]"));
  EXPECT_THAT(errorOf("[faults]\na = frozen\na = dropped\n"),
              AllOf(HasSubstr("faults.ini:3: "), HasSubstr("expected each key once")));
}

TEST(ShippedFaultFile, BeginsWithNoneAndTellsOfEveryKindAndKey) {
  const auto scenarios = readFaultFile(ETALON_FAULTS_INI);
  ASSERT_GE(scenarios.size(), 12u);
  EXPECT_TRUE(scenarios.front().faults.empty());
  std::ifstream in(ETALON_FAULTS_INI);
  std::stringstream text;
  text << in.rdbuf();
  for (const FaultKind& kind : faultKinds()) {
    EXPECT_THAT(text.str(), HasSubstr("\n;   " + kind.name + " ")) << kind.name;
    for (const auto& parameter : kind.parameters) {
      const bool of_many =
          parameter.key == "from" || parameter.key == "for" || parameter.key == "lens";
      EXPECT_THAT(text.str(),
                  HasSubstr(of_many ? "\n;   " + parameter.key + " " : " " + parameter.key + "="))
          << kind.name << " " << parameter.key;
    }
  }
}

}  // namespace
}  // namespace etalon
