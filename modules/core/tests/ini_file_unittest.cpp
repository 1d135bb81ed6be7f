#include "etalon/core/ini_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/core/parameters.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(IniFile, OfTwoFilesTheLaterCounts) {
  IniFile ini = IniFile::fromText("[run]\na = 1\nb = 2\n", "run.ini");
  ini.add(IniFile::fromText("[device]\nname = x\n[run]\nb = 3\n[empty]\n", "device.ini"));
  EXPECT_THAT(ini.sections(), ElementsAre("device", "empty", "run"));
  EXPECT_EQ(ini.section("run").at("a").text, "1");
  EXPECT_EQ(ini.section("run").at("a").origin, "run.ini:2");
  EXPECT_EQ(ini.section("run").at("b").text, "3");
  EXPECT_EQ(ini.section("run").at("b").origin, "device.ini:4");
  EXPECT_EQ(ini.sectionOrigin("run"), "run.ini:1");
  EXPECT_EQ(ini.sectionOrigin("device"), "device.ini:1");
}

TEST(IniFile, AnErrorNamesTheFileThatTheValueIsFrom) {
  IniFile ini = IniFile::fromText("[run]\na = 1\n", "run.ini");
  ini.add(IniFile::fromText("[run]\nb = 3\n", "device.ini"));
  double a = 0.0;
  ParameterSet set("run");
  set.add("a", &a, {0.0, 10.0}, "A number.");
  try {
    set.read(ini);
    FAIL() << "the key 'b' is unknown";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("device.ini:2"));
  }
}

}  // namespace
}  // namespace etalon
