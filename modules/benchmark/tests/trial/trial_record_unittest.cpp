#include "etalon/benchmark/trial/trial_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/testing/example_trial.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

BenchmarkSequence ofLength(double seconds) {
  BenchmarkSequence sequence;
  sequence.last_image = durationNs(seconds);
  return sequence;
}

TEST(TrialStarts, AreEvenlyOverTheRecording) {
  TrialProtocol protocol;
  protocol.seconds = 12.0;
  protocol.starts = 3;
  EXPECT_THAT(startsOf(protocol, ofLength(52.0)), ElementsAre(0.0, 20.0, 40.1));
  protocol.starts = 1;
  EXPECT_THAT(startsOf(protocol, ofLength(52.0)), ElementsAre(0.0));
}

TEST(TrialStarts, AreFewerWhereTheRecordingIsShort) {
  TrialProtocol protocol;
  protocol.seconds = 12.0;
  EXPECT_TRUE(startsOf(protocol, ofLength(10.0)).empty());
  // The last image of 12 s at 20 Hz is at 11.95 s.
  EXPECT_THAT(startsOf(protocol, ofLength(11.95)), ElementsAre(0.0));
  protocol.seconds = 0.0;
  EXPECT_THAT(startsOf(protocol, ofLength(10.0)), ElementsAre(0.0));
}

TEST(TrialStarts, ThatAreGivenAreUsedWhereARunFits) {
  TrialProtocol protocol;
  protocol.seconds = 12.0;
  protocol.from_s = {5.0, 20.0, 25.0};
  EXPECT_THAT(startsOf(protocol, ofLength(32.0)), ElementsAre(5.0, 20.0));
  protocol.seconds = 0.0;
  EXPECT_THAT(startsOf(protocol, ofLength(22.0)), ElementsAre(5.0, 20.0));
}

TEST(TrialStarts, WhatIsLeftOutIsNamed) {
  TrialRecord record;
  record.protocol.seconds = 12.0;
  record.sequences = {ofLength(6.95), ofLength(32.0)};
  record.sequences[0].name = "short";
  record.sequences[1].name = "long";
  EXPECT_THAT(tooShort(record),
              ElementsAre("short: too short for runs of 12 s (needs 11.90 s, has 6.95 s): 0 runs"));
  record.protocol.from_s = {5.0, 25.0};
  EXPECT_THAT(
      tooShort(record),
      ElementsAre(
          "short: too short for runs of 12 s from 5 s (needs 16.90 s, has 6.95 s): 0 runs",
          "short: too short for runs of 12 s from 25 s (needs 36.90 s, has 6.95 s): 0 runs",
          "long: too short for runs of 12 s from 25 s (needs 36.90 s, has 32.00 s): none from "
          "there"));
  record.sequences.pop_back();
  record.sequences[0].error = "unreadable";
  EXPECT_TRUE(tooShort(record).empty());
}

TEST(TrialVariant, IsNamedByWhatTellsItFromTheOthers) {
  TrialRecord record = testing::exampleTrial();
  const TrialVariant variant = variantsOf(record).front();
  EXPECT_EQ(labelOf(variant, record), "one");
  record.odometries.push_back("stereo_visual");
  EXPECT_EQ(labelOf(variant, record), "fixed_lag one");
  record.initializers.resize(1);
  EXPECT_EQ(labelOf(variant, record), "fixed_lag");
  record.odometries.resize(1);
  EXPECT_EQ(labelOf(variant, record), "one");
  record.settings = {{"wide", ""}, {"narrow", ""}};
  EXPECT_EQ(labelOf({"", "wide", "fixed_lag", "one"}, record), "wide");
  record.systems = {{"theirs", "/there"}};
  EXPECT_EQ(labelOf(variantsOf(record).back(), record), "theirs");
  EXPECT_EQ(variantsOf(record).size(), 3U);
}

TEST(TrialFiles, HaveNamesWithoutSurprises) {
  EXPECT_EQ(trajectoryName("V1_02", 12.5, "dark 1/2"), "V1_02-12.5-dark_1_2.tum");
  EXPECT_EQ(folderName({"", "wide", "fixed_lag", "eta"}), "wide-fixed_lag-eta");
  EXPECT_EQ(folderName({"", "", "fixed_lag", "eta"}), "fixed_lag-eta");
}

TEST(TrialRunsCsv, HasAFieldForEveryColumn) {
  const TrialRecord record = testing::exampleTrial();
  const std::string csv = runsCsv(record.results);
  const std::string header = csv.substr(0, csv.find('\n'));
  const auto commas = std::count(header.begin(), header.end(), ',');
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 17);
  const std::string row =
      csv.substr(header.size() + 1, csv.find('\n', header.size() + 1) - header.size() - 1);
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), commas);
  EXPECT_THAT(row,
              HasSubstr("a,0,,,fixed_lag,one,none,survived,0,,10,200,200,200,1,,0.75,inertial"));
  EXPECT_THAT(csv, HasSubstr("\"at 5.00 s dead_reckoning: the images show no landmark, a comma\""));
  EXPECT_THAT(header, ::testing::EndsWith(",frame_ms"));  // what is a time stands at the end
}

TEST(TrialRunsCsv, SaysHowManyFramesHaveAPose) {
  const TrialRun last = testing::exampleTrial().results.back();
  EXPECT_DOUBLE_EQ(last.coverage(), 0.75);
  EXPECT_EQ(TrialRun().coverage(), 0.0);
}

}  // namespace
}  // namespace etalon
