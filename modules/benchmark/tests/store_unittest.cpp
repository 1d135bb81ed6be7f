#include "etalon/benchmark/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "etalon/core/errors.h"
#include "etalon/testing/example_benchmark.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using etalon::testing::exampleBenchmark;
using ::testing::HasSubstr;

class BenchmarkStoreTest : public ::testing::Test {
 protected:
  std::string folder() const { return folder_.path(); }
  std::string resultsFile(const BenchmarkRecord& record) const {
    return (folder_ / "windows" / (record.results.front().sequence + ".jsonl")).string();
  }

  /** Writes head and windows, the windows in the reverse order of `record`. */
  void write(const BenchmarkRecord& record) {
    writeBenchmarkHead(folder(), record);
    ResultStore store(folder());
    for (auto result = record.results.rbegin(); result != record.results.rend(); ++result)
      store.append(*result);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(BenchmarkStoreTest, ReadsBackWhatItWrote) {
  BenchmarkRecord record = exampleBenchmark();
  sortResults(&record);
  record.results[0].truth_check.velocity_step_mps = 0.031;
  write(record);
  EXPECT_TRUE(isBenchmarkFolder(folder()));
  const BenchmarkRecord read = readBenchmark(folder());
  EXPECT_EQ(windowsCsv(windowRows(read)), windowsCsv(windowRows(record)));
  ASSERT_EQ(read.sequences.size(), record.sequences.size());
  for (size_t i = 0; i < read.sequences.size(); ++i) {
    EXPECT_EQ(read.sequences[i].name, record.sequences[i].name);
    EXPECT_EQ(read.sequences[i].error, record.sequences[i].error);
    EXPECT_EQ(read.sequences[i].gyro_agreement.isCopy(), i == 0);
  }
  for (size_t i = 0; i < read.results.size(); ++i) {
    if (record.results[i].sequence == "none")
      EXPECT_TRUE(std::isnan(read.results[i].truth_check.rre_deg));
    else
      EXPECT_EQ(read.results[i].truth_check.rre_deg, record.results[i].truth_check.rre_deg);
    EXPECT_EQ(std::isnan(read.results[i].truth_check.gyro_bias_rps),
              std::isnan(record.results[i].truth_check.gyro_bias_rps));
    if (i == 0) {
      EXPECT_EQ(read.results[i].truth_check.velocity_step_mps, 0.031);
    }
    ASSERT_EQ(read.results[i].noise.has_value(), record.results[i].noise.has_value());
    if (read.results[i].noise) {
      EXPECT_EQ(read.results[i].noise->gyro.chi2, record.results[i].noise->gyro.chi2);
      EXPECT_EQ(read.results[i].noise->coupling, record.results[i].noise->coupling);
    }
    EXPECT_EQ(read.results[i].truth.size(), record.results[i].truth.size());
  }
}

TEST_F(BenchmarkStoreTest, LeavesOutALineThatWasCutAndChangesNothing) {
  BenchmarkRecord record = exampleBenchmark();
  sortResults(&record);
  write(record);
  const auto size = fs::file_size(resultsFile(record));
  fs::resize_file(resultsFile(record), size - 10);
  EXPECT_EQ(readBenchmark(folder()).results.size(), record.results.size() - 1);
  EXPECT_EQ(fs::file_size(resultsFile(record)), size - 10);
  // A result that is appended now has a line of its own.
  ResultStore(folder()).append(record.results.front());
  EXPECT_EQ(readBenchmark(folder()).results.size(), record.results.size());
}

TEST_F(BenchmarkStoreTest, NamesFileAndLineOfWhatIsNoResult) {
  const BenchmarkRecord record = exampleBenchmark();
  write(record);
  const std::string file = resultsFile(record);
  fs::resize_file(file, 0);
  std::ofstream(file) << "{\"sequence\": \"x\"}\n";
  try {
    readBenchmark(folder());
    FAIL() << "no error";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr(file + ":1"));
    EXPECT_THAT(e.what(), HasSubstr("'window'"));
  }
}

TEST_F(BenchmarkStoreTest, RefusesNumbersThatNoBenchmarkHas) {
  const BenchmarkRecord record = exampleBenchmark();
  writeBenchmarkHead(folder(), record);
  const std::string file = (folder_ / "benchmark.json").string();
  std::ifstream in(file);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  const auto errorWith = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = good;
    const size_t at = text.find(from);
    if (at == std::string::npos) return "no '" + from + "' in the file";
    std::ofstream(file) << text.replace(at, from.size(), to);
    try {
      readBenchmark(folder());
    } catch (const DataError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(errorWith("\"V1\"", "\"V1\""), "");
  EXPECT_THAT(errorWith("\"V1\"", "\"../V1\""), HasSubstr("without '/'"));
  for (const char* every : {"0", "-1", "null", "1e300"})
    EXPECT_THAT(errorWith("\"every_s\": 2.5", "\"every_s\": " + std::string(every)),
                HasSubstr("expected a number from 0.01 to"));
  EXPECT_THAT(errorWith("\"every_s\": 2.5", "\"every_s\": 1e999"), HasSubstr("expected JSON"));
  EXPECT_THAT(errorWith("\"shard\": 1", "\"shard\": 1.5"), HasSubstr("expected an integer"));
  const std::string last = "\"last_image_ns\": 0";
  EXPECT_THAT(errorWith(last, "\"last_image_ns\": 9000000000000000000"),
              HasSubstr("a stamp in ns"));
  EXPECT_THAT(errorWith(last, "\"last_image_ns\": -5"), HasSubstr("a stamp in ns"));
  EXPECT_THAT(errorWith(last, "\"last_image_ns\": 900000000000000000"), HasSubstr("7 days apart"));
}

TEST_F(BenchmarkStoreTest, KnowsWhichResultsAreMissing) {
  BenchmarkRecord record;
  record.protocol.every_s = 2.5;
  record.initializers = {{"eta", "1", "", "", ""}};
  BenchmarkSequence sequence;
  sequence.name = "a";
  sequence.last_image = durationNs(10.0);
  record.sequences = {sequence};
  // Windows at 0, 2.5, 5 and 7.5 s: the last one ends at 9.75 s.
  EXPECT_EQ(missingResults(record).size(), 4U);
  WindowResult result;
  result.sequence = "a";
  result.window = 2;
  result.keyframes = 10;
  result.rate_hz = 4.0;
  result.initializer = "eta";
  record.results = {result};
  EXPECT_THAT(missingResults(record),
              ::testing::ElementsAre("a, 10 keyframes at 4 Hz, window 0, eta",
                                     "a, 10 keyframes at 4 Hz, window 1, eta",
                                     "a, 10 keyframes at 4 Hz, window 3, eta"));
  record.sequences.front().error = "cannot be read";
  EXPECT_TRUE(missingResults(record).empty());
}

}  // namespace
}  // namespace etalon
