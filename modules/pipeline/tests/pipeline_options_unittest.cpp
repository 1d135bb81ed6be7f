// Every key of the configuration: bound to a member of its own, documented, with its range.

#include "etalon/pipeline/pipeline_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Keys = std::map<std::string, std::string>;  ///< "[section] key" and value

Keys valuesOf(PipelineOptions* options) {
  Keys values;
  for (const ParameterSet& section : options->sections())
    for (const ParameterSet::Description& d : section.describe())
      values["[" + section.section() + "] " + d.key] = d.default_value;
  return values;
}

void read(PipelineOptions* options, const std::string& section, const std::string& line) {
  const IniFile ini = IniFile::fromText("[" + section + "]\n" + line + "\n", "test.ini");
  for (const ParameterSet& set : options->sections())
    if (set.section() == section) set.read(ini);
}

/** Another value of the same kind, in the range. */
std::string anotherValue(const ParameterSet::Description& d) {
  if (d.type == "boolean") return d.default_value == "true" ? "false" : "true";
  if (d.type == "text") return d.default_value + "x";
  if (d.type == "choice") {
    const std::string first = d.range.substr(0, d.range.find(','));
    return first != d.default_value ? first : d.range.substr(d.range.rfind(' ') + 1);
  }
  const double value = std::stod(d.default_value);
  if (d.type == "integer") return std::to_string(static_cast<int>(value) + 2);  // odd stays odd
  return value == 0.0 ? "0.015625" : std::to_string(0.75 * value);
}

TEST(PipelineOptionsKeys, EveryKeySetsItsOwnMemberAndNoOther) {
  PipelineOptions defaults;
  const Keys before = valuesOf(&defaults);
  EXPECT_GT(before.size(), 60U);
  for (const ParameterSet& section : defaults.sections())
    for (const ParameterSet::Description& d : section.describe()) {
      const std::string key = "[" + section.section() + "] " + d.key;
      PipelineOptions options;
      ASSERT_NO_THROW(read(&options, section.section(), d.key + " = " + anotherValue(d))) << key;
      for (const auto& [other, value] : valuesOf(&options)) {
        if (other == key)
          EXPECT_NE(value, before.at(key)) << key << " does not change";
        else
          EXPECT_EQ(value, before.at(other)) << key << " changes " << other;
      }
    }
}

TEST(PipelineOptionsKeys, WhatIsWrittenReadsBackTheSame) {
  PipelineOptions options;
  options.initializer = "drt";
  options.window.priors.mean.accel = {1.0 / 3.0, -2e-7, 0.1};
  options.frontend.klt_window_px = 23;
  options.map.enabled = false;
  options.odometry_kind = kStereoVisual;
  std::string text;
  for (const ParameterSet& section : options.sections()) text += section.toIni() + "\n";
  PipelineOptions again;
  const IniFile ini = IniFile::fromText(text, "written.ini");
  for (const ParameterSet& section : again.sections()) section.read(ini);
  EXPECT_EQ(valuesOf(&again), valuesOf(&options));
  EXPECT_EQ(again.window.priors.mean.accel, options.window.priors.mean.accel);  // to the bit
}

TEST(PipelineOptionsKeys, SectionsAndKeysAreUniqueAndDocumentedInSentences) {
  PipelineOptions options;
  std::set<std::string> names;
  for (const ParameterSet& section : options.sections()) {
    EXPECT_TRUE(names.insert(section.section()).second) << section.section();
    std::set<std::string> keys;
    for (const ParameterSet::Description& d : section.describe()) {
      EXPECT_TRUE(keys.insert(d.key).second) << d.key;
      EXPECT_GT(d.doc.size(), 15U) << d.key;
      // Of a sentence over several keys the last part ends it.
      EXPECT_TRUE(d.doc.back() == '.' || d.doc.substr(d.doc.size() - 3) == "...") << d.doc;
    }
  }
  for (const char* name : {"pipeline", "auto", "priors", "input", "imu_noise", "frontend",
                           "odometry", "fixed_lag", "map", "vi_ba", "acceptance"})
    EXPECT_EQ(names.count(name), 1U) << name;
}

TEST(PipelineOptionsKeys, PriorsAreByAxis) {
  PipelineOptions options;
  read(&options, "priors",
       "gyro_bias_mean_x_rps = 0.1\ngyro_bias_mean_y_rps = 0.2\ngyro_bias_mean_z_rps = 0.3\n"
       "accel_bias_mean_x_mps2 = 1\naccel_bias_mean_y_mps2 = 2\naccel_bias_mean_z_mps2 = 3\n"
       "gyro_bias_sigma_rps = 0.25\naccel_bias_sigma_mps2 = 0.5");
  EXPECT_EQ(options.window.priors.mean.gyro, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(options.window.priors.mean.accel, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(options.window.priors.sigma_gyro_rps, 0.25);
  EXPECT_EQ(options.window.priors.sigma_accel_mps2, 0.5);
}

TEST(PipelineOptionsKeys, ValuesOutOfRangeAreNamedWithTheirPlace) {
  const auto errorOf = [](const std::string& section, const std::string& line) -> std::string {
    PipelineOptions options;
    try {
      read(&options, section, line);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(errorOf("pipeline", "keyframes = 1"),
              AllOf(HasSubstr("test.ini:2"), HasSubstr("[pipeline] keyframes = '1'")));
  EXPECT_EQ(errorOf("pipeline", "keyframes = 2"), "");
  EXPECT_EQ(errorOf("pipeline", "keyframes = 200"), "");
  EXPECT_NE(errorOf("pipeline", "keyframes = 201"), "");
  EXPECT_NE(errorOf("pipeline", "keyframes = 10.5"), "");
  EXPECT_NE(errorOf("pipeline", "gravity_mps2 = 0"), "");
  EXPECT_NE(errorOf("priors", "gyro_bias_sigma_rps = 0"), "");
  EXPECT_NE(errorOf("odometry", "max_dead_reckoning_s = -1"), "");
  EXPECT_THAT(errorOf("odometry", "kind = fixed_leg"),
              AllOf(HasSubstr("[odometry] kind"), HasSubstr("fixed_lag")));
  EXPECT_THAT(errorOf("pipeline", "keyframe = 10"), HasSubstr("did you mean 'keyframes'?"));
}

}  // namespace
}  // namespace etalon
