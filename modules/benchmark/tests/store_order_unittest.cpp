// A benchmark's results: their order, which are missing, and which are removed for a new start.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
namespace fs = std::filesystem;

/** Two recordings of 5 s, two lengths of windows at two rates, two initializers. */
BenchmarkRecord head() {
  BenchmarkRecord record;
  record.protocol.every_s = 2.5;
  record.protocol.keyframes = {10, 5};
  record.protocol.rates_hz = {4.0, 10.0};
  record.initializers = {{"eta", "1", "", "", ""}, {"drt", "1", "", "", ""}};
  for (const char* name : {"b", "a"}) {
    BenchmarkSequence sequence;
    sequence.name = name;
    sequence.last_image = durationNs(5.0);
    record.sequences.push_back(sequence);
  }
  return record;
}

WindowResult result(const std::string& sequence, int keyframes, double rate_hz, int window,
                    const std::string& initializer) {
  WindowResult result;
  result.sequence = sequence;
  result.keyframes = keyframes;
  result.rate_hz = rate_hz;
  result.window = window;
  result.initializer = initializer;
  return result;
}

std::vector<std::string> keysOf(const BenchmarkRecord& record) {
  std::vector<std::string> keys;
  for (const WindowResult& r : record.results) keys.push_back(resultKey(r));
  return keys;
}

TEST(SortResults, TheOrderIsThatOfTheHeadAndWhatItDoesNotListGoes) {
  BenchmarkRecord record = head();
  record.results = {result("a", 10, 4.0, 0, "eta"),  result("b", 5, 4.0, 0, "eta"),
                    result("b", 10, 10.0, 0, "eta"), result("b", 10, 4.0, 1, "eta"),
                    result("b", 10, 4.0, 0, "drt"),  result("b", 10, 4.0, 0, "eta"),
                    result("c", 10, 4.0, 0, "eta"),  result("b", 7, 4.0, 0, "eta"),
                    result("b", 10, 5.0, 0, "eta"),  result("b", 10, 4.0, 0, "orb")};
  sortResults(&record);
  EXPECT_THAT(keysOf(record), ElementsAre("b, 10 keyframes at 4 Hz, window 0, eta",
                                          "b, 10 keyframes at 4 Hz, window 0, drt",
                                          "b, 10 keyframes at 4 Hz, window 1, eta",
                                          "b, 10 keyframes at 10 Hz, window 0, eta",
                                          "b, 5 keyframes at 4 Hz, window 0, eta",
                                          "a, 10 keyframes at 4 Hz, window 0, eta"));
}

TEST(Incompleteness, IsToldInAllAndByRecordingAndShard) {
  BenchmarkRecord record = head();
  // A window needs 2.125 s or 0.85 s for ten keyframes, 0.875 s or 0.35 s for five: two fit in 5 s.
  for (const char* sequence : {"a", "b"})
    for (const int keyframes : {10, 5})
      for (const double rate_hz : {4.0, 10.0})
        for (const int window : {0, 1})
          for (const char* initializer : {"eta", "drt"})
            record.results.push_back(result(sequence, keyframes, rate_hz, window, initializer));
  EXPECT_THAT(incompleteness(record), IsEmpty());
  EXPECT_THAT(missingResults(record), IsEmpty());
  record.results.erase(record.results.begin() + 3, record.results.begin() + 6);
  EXPECT_THAT(incompleteness(record),
              ElementsAre("unfinished: 3 of 32 results are missing", "a: 3 of 16 results missing"));
  EXPECT_EQ(missingResults(record).size(), 3U);
  record.sequences[1].error = "cannot be read";
  record.shards = 4;
  record.shard = 2;
  EXPECT_THAT(incompleteness(record),
              ElementsAre("it is shard 2 of 4; etalon merge joins the shards",
                          "a: not in it: cannot be read"));
}

TEST(DiscardBenchmark, NothingOutlivesItButTheHead) {
  const testing::TemporaryFolder folder;
  BenchmarkRecord record = head();
  EXPECT_FALSE(isBenchmarkFolder(folder.path()));
  writeBenchmarkHead(folder.path(), record);
  ResultStore(folder.path()).append(result("a", 10, 4.0, 0, "eta"));
  EXPECT_FALSE(hasBenchmarkResults(folder.path()));
  const auto paths =
      writeBenchmarkResults(folder.path(), record, [](const BenchmarkRecord&) { return "a page"; });
  ASSERT_EQ(paths.size(), 3U);
  EXPECT_TRUE(std::all_of(paths.begin(), paths.end(),
                          [](const std::string& path) { return fs::exists(path); }));
  EXPECT_TRUE(hasBenchmarkResults(folder.path()));
  EXPECT_EQ(readBenchmark(folder.path()).results.size(), 1U);
  discardBenchmark(folder.path());
  EXPECT_TRUE(isBenchmarkFolder(folder.path()));
  EXPECT_FALSE(hasBenchmarkResults(folder.path()));
  EXPECT_THAT(readBenchmark(folder.path()).results, IsEmpty());
  EXPECT_FALSE(fs::exists(folder / "windows"));
  EXPECT_FALSE(fs::exists(folder / "report.html"));
  // Without a report function no report is written; where nothing can be written, it throws.
  EXPECT_EQ(writeBenchmarkResults(folder.path(), record, nullptr).size(), 2U);
  EXPECT_THROW(ResultStore(folder.path()).append(result("a", 10, 4.0, 0, "eta")), DataError);
}

TEST(ResultText, IsALineOfItsOwnWhateverIsInIt) {
  WindowResult written = result("a", 10, 4.0, 3, "eta");
  written.attempt.status = "not_converged";
  written.attempt.reason = "line one\nline \"two\"\t\xC3\xA9 \xFF";
  const std::string text = resultToText(written);
  EXPECT_EQ(text.find('\n'), std::string::npos);
  const WindowResult read = resultFromText(text);
  EXPECT_EQ(resultKey(read), resultKey(written));
  // Control characters are escaped; what is not UTF-8 becomes the replacement character.
  EXPECT_EQ(read.attempt.reason, "line one\\nline \"two\"\\t\xC3\xA9 \xEF\xBF\xBD");
  EXPECT_THROW(resultFromText("{"), DataError);
  EXPECT_THROW(resultFromText("{}"), DataError);
}

}  // namespace
}  // namespace etalon
