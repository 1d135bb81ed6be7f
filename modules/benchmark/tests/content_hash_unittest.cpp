#include "etalon/benchmark/content_hash.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using testing::TemporaryFolder;

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

TEST(ContentHash, IsXxh3Of128Bit) {
  // XXH3_128bits of the empty input, seed 0, from the test vectors of xxHash 0.8.
  EXPECT_EQ(ContentHash().hex(), "99aa06d3014798d86001c324468d497f");
}

TEST(ContentHash, DependsOnOrderAndOnWhereATextEnds) {
  const auto hash = [](const std::vector<std::string>& texts) {
    ContentHash h;
    for (const std::string& text : texts) h.add(text);
    return h.hex();
  };
  EXPECT_EQ(hash({"ab", "c"}), hash({"ab", "c"}));
  EXPECT_NE(hash({"ab", "c"}), hash({"a", "bc"}));
  EXPECT_NE(hash({"ab", "c"}), hash({"c", "ab"}));
  EXPECT_NE(hash({"ab"}), hash({"ab", ""}));
}

TEST(ContentHash, CanBeReadInBetween) {
  ContentHash h;
  h.add(std::string("a"));
  const std::string first = h.hex();
  EXPECT_EQ(h.hex(), first);
  h.add(std::string("b"));
  EXPECT_NE(h.hex(), first);
}

TEST(ContentHash, OfAFileIsThatOfItsBytesNotOfItsName) {
  const TemporaryFolder folder;
  const std::string one = folder / "one", two = folder / "two", other = folder / "other";
  const std::string long_text(3'000'000, 'x');  // in several pieces
  write(one, long_text);
  write(two, long_text);
  write(other, long_text.substr(1) + "y");
  EXPECT_EQ(fileHash(one), fileHash(two));
  EXPECT_NE(fileHash(one), fileHash(other));
  EXPECT_EQ(fileHash(one).size(), 32u);
  ContentHash joined, apart;  // where a file ends counts, too
  write(one, "ab");
  write(two, "c");
  joined.addFile(one);
  joined.addFile(two);
  write(one, "a");
  write(two, "bc");
  apart.addFile(one);
  apart.addFile(two);
  EXPECT_NE(joined.hex(), apart.hex());
}

TEST(ContentHash, NamesAFileThatCannotBeRead) {
  const TemporaryFolder folder;
  try {
    fileHash(folder / "missing");
    FAIL() << "accepted";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr(folder / "missing"));
  }
}

TEST(ContentHash, OfLibrariesTellsThemApart) {
  EXPECT_EQ(librariesHash({}), ContentHash().hex());
  EXPECT_EQ(librariesHash({"no_such_module"}), ContentHash().hex());
  EXPECT_NE(librariesHash({"core"}), librariesHash({"benchmark"}));
  EXPECT_EQ(librariesHash({"core", "benchmark"}), librariesHash({"core", "benchmark"}));
  EXPECT_EQ(programHash(), programHash());
}

}  // namespace
}  // namespace etalon
