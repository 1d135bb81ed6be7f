// What the folders of benchmarks and trials share.
#include "suite/suite_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

SuiteRecord suite() {
  SuiteRecord record;
  record.versions = {{"etalon", "1"}, {"opencv", "4"}};
  record.binaries = "0123456789";
  record.config = "[a]\nx = 1\ny = 2\n";
  record.initializers = {{"one", "1", "", "plugin", "[one]\nk = 1\n"}};
  BenchmarkSequence sequence;
  sequence.name = "flight";
  sequence.content = "content";
  sequence.stereo_frames = 10;
  sequence.last_image = durationNs(1.0);
  record.sequences = {sequence};
  return record;
}

std::string difference(const std::function<void(SuiteRecord*)>& change,
                       const std::string& of_protocols = "") {
  SuiteRecord other = suite();
  change(&other);
  return differenceOfSuites(suite(), other, of_protocols);
}

TEST(SuiteDifference, OfEqualsIsNothing) {
  EXPECT_EQ(difference([](SuiteRecord*) {}), "");
  EXPECT_EQ(difference([](SuiteRecord*) {}, "other windows"), "other windows");
}

TEST(SuiteDifference, NamesVersionsOfAnotherBuild) {
  EXPECT_THAT(difference([](SuiteRecord* r) {
                r->binaries = "9876543210";
                r->versions["opencv"] = "5";
              }),
              AllOf(HasSubstr("another build"), HasSubstr("opencv 4 and 5"),
                    HasSubstr("01234567... and 98765432...")));
}

TEST(SuiteDifference, NamesTheFirstLineOfAnotherConfiguration) {
  EXPECT_THAT(difference([](SuiteRecord* r) { r->config = "[a]\nx = 1\ny = 3\n"; }),
              HasSubstr("'y = 2' and 'y = 3'"));
  EXPECT_THAT(difference([](SuiteRecord* r) { r->initializers[0].config = "[one]\nk = 2\n"; }),
              HasSubstr("configuration of 'one': 'k = 1' and 'k = 2'"));
}

TEST(SuiteDifference, NamesOtherInitializers) {
  EXPECT_EQ(difference([](SuiteRecord* r) { r->initializers.clear(); }), "other initializers");
  EXPECT_THAT(difference([](SuiteRecord* r) { r->initializers[0].name = "two"; }),
              HasSubstr("'one' and 'two'"));
}

TEST(SuiteDifference, NamesOtherRecordings) {
  EXPECT_EQ(difference([](SuiteRecord* r) { r->sequences.clear(); }), "other recordings");
  EXPECT_THAT(difference([](SuiteRecord* r) { r->sequences[0].name = "other"; }),
              HasSubstr("'flight' and 'other'"));
  EXPECT_THAT(difference([](SuiteRecord* r) { r->sequences[0].content = "x"; }),
              HasSubstr("'flight' has other content"));
  EXPECT_THAT(difference([](SuiteRecord* r) { r->sequences[0].last_image = 0; }),
              HasSubstr("another length"));
  // A recording that was not needed has no content.
  EXPECT_EQ(difference([](SuiteRecord* r) { r->sequences[0].content = ""; }), "");
}

TEST(SuiteDifference, ShardsMustAgreeOnWhatCanBeRead) {
  const auto unreadable = [](SuiteRecord* r) {
    r->sequences[0] = BenchmarkSequence();
    r->sequences[0].name = "flight";
    r->sequences[0].error = "no such file";
  };
  EXPECT_EQ(difference(unreadable), "");
  EXPECT_THAT(difference([&](SuiteRecord* r) {
                unreadable(r);
                r->shards = 2;
              }),
              HasSubstr("could not read the recording 'flight': no such file"));
}

TEST(SuiteJson, NamesPlaceAndReason) {
  try {
    parseJson("{\"a\": ", "runs/x.jsonl", 7);
    FAIL();
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("runs/x.jsonl:7"), HasSubstr("expected JSON")));
  }
  EXPECT_EQ(jsonText({{"a", 1}}, -1), "{\"a\":1}");
  EXPECT_EQ(jsonText({{"a", "\xff"}}, -1), "{\"a\":\"\xef\xbf\xbd\"}");  // invalid UTF-8
  EXPECT_THROW(readText("/nowhere/at/all"), DataError);
}

TEST(LineStore, KeepsLinesInOrderAndDropsOneThatWasCutWhenTheNextIsAppended) {
  const testing::TemporaryFolder folder;
  LineStore store(folder.path());
  for (const char* line : {"one", "two", "three"}) store.append("flight", line);
  std::vector<std::string> lines, places;
  const auto read = [&] {
    lines.clear();
    places.clear();
    LineStore(folder.path()).read("flight", [&](const std::string& line, const std::string& place) {
      lines.push_back(line);
      places.push_back(place.substr(place.rfind('/') + 1));
    });
  };
  read();
  EXPECT_THAT(lines, ElementsAre("one", "two", "three"));
  EXPECT_THAT(places, ElementsAre("flight.jsonl:1", "flight.jsonl:2", "flight.jsonl:3"));
  const std::string file = folder / "flight.jsonl";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 2);
  read();
  EXPECT_THAT(lines, ElementsAre("one", "two"));
  EXPECT_EQ(readText(file), "one\ntwo\nthre");
  LineStore(folder.path()).append("flight", "four");
  read();
  EXPECT_THAT(lines, ElementsAre("one", "two", "four"));
}

TEST(LineStore, WhatIsNotThereHasNoLines) {
  LineStore("/nowhere").read("flight", [](const std::string&, const std::string&) { FAIL(); });
  EXPECT_THROW(LineStore("/nowhere").append("flight", "line"), DataError);
}

}  // namespace
}  // namespace etalon
