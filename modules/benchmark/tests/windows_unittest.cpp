#include "etalon/benchmark/windows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/testing/example_benchmark.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::exampleBenchmark;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(BenchmarkWindows, RefuseARecordingOfYears) {
  EXPECT_NO_THROW(checkLength("a", 5, 5 + durationNs(kLongestRecordingS)));
  EXPECT_THROW(checkLength("a", 5, 6 + durationNs(kLongestRecordingS)), DataError);
}

TEST(BenchmarkWindows, EndWithTheRecording) {
  const WindowShape shape{10, 4.0};
  const auto count = [&](double seconds) {
    return windowCount(0, durationNs(seconds), 2.5, shape);
  };
  EXPECT_EQ(count(2.0), 0);  // half a keyframe's interval is granted, no more
  EXPECT_EQ(count(2.2), 1);
  EXPECT_EQ(count(4.6), 1);
  EXPECT_EQ(count(4.7), 2);
  EXPECT_EQ(count(84.0), 33);  // V1_02_medium
}

TEST(BenchmarkWindows, EveryNumberOfKeyframesWithEveryRate) {
  BenchmarkProtocol protocol;
  EXPECT_THAT(shapesOf(protocol), ElementsAre(WindowShape{10, 4.0}));
  protocol.keyframes = {10, 5};
  protocol.rates_hz = {4.0, 10.0};
  EXPECT_THAT(shapesOf(protocol), ElementsAre(WindowShape{10, 4.0}, WindowShape{10, 10.0},
                                              WindowShape{5, 4.0}, WindowShape{5, 10.0}));
  protocol.rates_hz.clear();
  EXPECT_THAT(shapesOf(protocol), IsEmpty());
}

TEST(BenchmarkWindows, HalfAKeyframeIntervalIsGranted) {
  EXPECT_DOUBLE_EQ(shortestRecording({10, 4.0}), 8.5 / 4.0);
  EXPECT_DOUBLE_EQ(shortestRecording({5, 10.0}), 0.35);
  EXPECT_DOUBLE_EQ(shortestRecording({2, 1.0}), 0.5);
}

TEST(BenchmarkWindows, NamesRecordingsThatAreTooShort) {
  BenchmarkRecord record = exampleBenchmark();
  EXPECT_THAT(tooShort(record), IsEmpty());
  BenchmarkSequence shorter;
  shorter.name = "V2";
  shorter.last_image = 2'000'000'000;
  record.sequences.push_back(shorter);
  EXPECT_THAT(tooShort(record),
              ElementsAre("V2: too short for 10 keyframes at 4 Hz (needs 2.12 s, has 2.00 s): 0 "
                          "windows"));
  EXPECT_EQ(tooShort(record, {5, 4.0}).size(),
            2u);  // not V2; the example has no stamps of the others
  record.sequences.back().last_image = 2'200'000'000;  // long enough: not of this shard
  EXPECT_THAT(tooShort(record), IsEmpty());
  record.protocol.keyframes = {10, 100};
  EXPECT_EQ(tooShort(record).size(), 3u);
  record.sequences.back().error = "no images";  // said elsewhere
  EXPECT_EQ(tooShort(record).size(), 2u);
}

TEST(BenchmarkWindows, ShapesOfResultsThatTheProtocolDoesNotListCountToo) {
  BenchmarkRecord record = exampleBenchmark();
  record.protocol.keyframes = {100};
  EXPECT_EQ(tooShort(record).size(), 2u);  // both recordings; of the results' shape neither
  WindowResult longer = record.results.front();
  longer.keyframes = 50;
  record.results.push_back(longer);
  EXPECT_EQ(tooShort(record).size(), 3u);  // "none" has no window of 50 keyframes
}

TEST(BenchmarkWindows, ARecordingOfYearsIsADamagedStamp) {
  try {
    checkLength("V1", 0, 30 * durationNs(86'400.0));
    FAIL() << "accepted";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("V1"), HasSubstr("30 days apart"),
                                HasSubstr("is a stamp damaged?")));
  }
}

TEST(KeyframeRates, MustNotBeAboveTheCameras) {
  std::vector<TimeNs> stamps;
  for (int i = 0; i < 40; ++i)
    if (i != 7) stamps.push_back(50'000'000LL * i);  // an image is missing
  EXPECT_DOUBLE_EQ(imageRate(stamps), 20.0);
  EXPECT_EQ(imageRate({0}), 0.0);
  EXPECT_NO_THROW(checkKeyframeRates({4.0, 20.0}, 20.0, "V1"));
  EXPECT_NO_THROW(checkKeyframeRates({30.0}, 29.97, "V1"));
  try {
    checkKeyframeRates({4.0, 50.0}, 20.0, "V1");
    FAIL() << "accepted";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("50 keyframes a second"),
                                HasSubstr("'V1' has 20.0 images a second")));
  }
}

}  // namespace
}  // namespace etalon
