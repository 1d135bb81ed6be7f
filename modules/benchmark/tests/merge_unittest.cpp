#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** Two shards of a benchmark of two recordings, two windows each: the first has those of "a", the
 * second those of "b". */
class MergeTest : public ::testing::Test {
 protected:
  MergeTest() {
    one_ = shard(1);
    two_ = shard(2);
  }

  static BenchmarkRecord shard(int number) {
    BenchmarkRecord record;
    record.shard = number;
    record.shards = 2;
    record.binaries = "program";
    record.initializers = {{"eta", "1", "", "plugin", "[eta]\n"}};
    for (const char* name : {"a", "b"}) {
      BenchmarkSequence sequence;
      sequence.name = name;
      sequence.last_image = durationNs(5.0);
      sequence.duration_s = 5.0;
      sequence.stereo_frames = 100;
      const bool needed = (number == 1) == (sequence.name == "a");
      if (needed) sequence.content = std::string("content of ") + name;
      record.sequences.push_back(sequence);
      for (int window = 0; needed && window < 2; ++window) {
        WindowResult result;
        result.sequence = name;
        result.window = window;
        result.t0 = durationNs(2.5 * window);
        result.keyframes = 10;
        result.rate_hz = 4.0;
        result.initializer = "eta";
        result.attempt.status = "degenerate_motion";
        record.results.push_back(result);
      }
    }
    return record;
  }

  std::string folder(const std::string& name) const { return (root_ / name).string(); }

  BenchmarkOutcome merge() const {
    for (const char* name : {"1", "2", "merged"}) fs::remove_all(root_ / name);
    for (const BenchmarkRecord* record : {&one_, &two_}) {
      const std::string path = folder(std::to_string(record->shard));
      fs::create_directories(path);
      writeBenchmarkHead(path, *record);
      ResultStore store(path);
      for (const WindowResult& result : record->results) store.append(result);
      writeBenchmarkResults(path, *record, nullptr);
    }
    return mergeBenchmarks({folder("1"), folder("2")}, folder("merged"), false, nullptr);
  }

  std::string refusal() const {
    try {
      merge();
    } catch (const ConfigError& e) {
      EXPECT_FALSE(fs::exists(folder("merged")));
      return e.what();
    }
    return "it was not refused";
  }

  testing::TemporaryFolder root_;
  BenchmarkRecord one_, two_;
};

TEST_F(MergeTest, JoinsWhatBelongsTogether) {
  const BenchmarkOutcome outcome = merge();
  EXPECT_EQ(outcome.results_found, 4U);
  EXPECT_EQ(outcome.record.sequences[0].content, "content of a");
  EXPECT_EQ(outcome.record.sequences[1].content, "content of b");
  EXPECT_EQ(outcome.record.shards, 1);
}

TEST_F(MergeTest, RefusesAnotherBuildOfTheProgram) {
  two_.binaries = "another";
  EXPECT_THAT(refusal(), HasSubstr("another build of etalon"));
}

TEST_F(MergeTest, RefusesAnotherBuildOfAPlugin) {
  two_.initializers[0].binary = "another";
  EXPECT_THAT(refusal(), HasSubstr("another build of the plugin 'eta'"));
}

TEST_F(MergeTest, RefusesARecordingOfOtherContent) {
  two_.sequences[0].content = "something else";
  EXPECT_THAT(refusal(), HasSubstr("the recording 'a' has other content"));
}

TEST_F(MergeTest, RefusesAnotherShareOfGroundTruthAndKeepsTheirs) {
  two_.protocol.min_coverage = 0.2;
  EXPECT_THAT(refusal(), HasSubstr("--min-coverage 0.5 and 0.2"));
  one_.protocol.min_coverage = 0.2;
  EXPECT_EQ(merge().record.protocol.min_coverage, 0.2);
}

TEST_F(MergeTest, ARecordingThatOnlyAnotherShardNeededKeepsItsError) {
  two_.sequences[1].error = "cam0: no stereo pair can be read";
  two_.results.clear();
  const BenchmarkOutcome outcome = merge();
  EXPECT_EQ(outcome.results_found, 2U);
  EXPECT_EQ(outcome.record.sequences[1].error, "cam0: no stereo pair can be read");
}

TEST_F(MergeTest, AnErrorWithoutContentIsKeptToo) {
  two_.sequences[1].error = "imu0: changed while it was read";
  two_.sequences[1].content.clear();
  two_.results.clear();
  EXPECT_EQ(merge().record.sequences[1].error, "imu0: changed while it was read");
}

TEST_F(MergeTest, RefusesWhereOneShardCouldNotOpenARecording) {
  for (BenchmarkRecord* record : {&one_, &two_}) {
    for (const size_t unreadable : {0U, 1U}) {
      const BenchmarkRecord whole = *record;
      BenchmarkSequence sequence;
      sequence.name = record->sequences[unreadable].name;
      sequence.error = "imu0/data.csv: empty";
      record->sequences[unreadable] = sequence;
      EXPECT_THAT(refusal(), AllOf(HasSubstr("could not read the recording '" + sequence.name),
                                   HasSubstr("imu0/data.csv: empty")));
      *record = whole;
    }
  }
}

TEST_F(MergeTest, RefusesWhereOneShardCouldNotOpenTheOnlyRecording) {
  for (BenchmarkRecord* record : {&one_, &two_}) record->sequences.resize(1);
  one_.results.pop_back();
  two_.results.clear();
  two_.sequences[0] = {};
  two_.sequences[0].name = "a";
  two_.sequences[0].error = "imu0/data.csv: empty";
  EXPECT_THAT(refusal(), HasSubstr("could not read the recording 'a': imu0/data.csv: empty"));
}

TEST_F(MergeTest, ARecordingThatNoShardCouldOpenIsLeftOut) {
  for (BenchmarkRecord* record : {&one_, &two_}) {
    record->sequences[1] = {};
    record->sequences[1].name = "b";
    record->sequences[1].error = "imu0/data.csv: empty";
  }
  one_.results.pop_back();  // the windows of "a" are dealt out to both
  two_.results = {shard(1).results.back()};
  two_.sequences[0].content = "content of a";
  const BenchmarkOutcome outcome = merge();
  EXPECT_EQ(outcome.results_found, 2U);
  EXPECT_EQ(outcome.record.sequences[1].error, "imu0/data.csv: empty");
}

}  // namespace
}  // namespace etalon
