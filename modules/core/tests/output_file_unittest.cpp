#include "etalon/core/output_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class OutputFileTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static std::string content(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  /** Number of files and folders in the folder. */
  std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator());
  }

  testing::TemporaryFolder folder_;
};

/** As long as it lives no file can become longer than this: as on a disk that is full. */
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }

 private:
  rlimit before_{};
  void (*signal_)(int);
};

TEST_F(OutputFileTest, HasItsNameOnceItIsWhole) {
  OutputFile file(path("a.txt"));
  file.stream() << "whole";
  EXPECT_FALSE(fs::exists(path("a.txt")));
  file.putInPlace();
  EXPECT_EQ(content(path("a.txt")), "whole");
  EXPECT_EQ(entries(), 1);
}

TEST_F(OutputFileTest, OfSeveralWritersTheLastOneStaysWhole) {
  OutputFile one(path("a.txt")), two(path("a.txt"));
  for (int i = 0; i < 10000; ++i) {
    one.stream() << "1";
    two.stream() << "2";
  }
  two.putInPlace();
  one.putInPlace();
  EXPECT_EQ(content(path("a.txt")), std::string(10000, '1'));
  EXPECT_EQ(entries(), 1);
}

TEST_F(OutputFileTest, WhatCannotBeWrittenWholeLeavesTheOldFile) {
  writeFile(path("a.txt"), "old");
  const FileSizeLimit limit(4096);
  try {
    writeFile(path("a.txt"), std::string(100'000, 'x'));
    FAIL() << "written";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr(path("a.txt") + ": cannot be written: "));
  }
  EXPECT_EQ(content(path("a.txt")), "old");
  EXPECT_EQ(entries(), 1);
}

TEST_F(OutputFileTest, WritesToADeviceAndThroughALink) {
  EXPECT_THROW(writeFile("/dev/full", "text"), DataError);
  EXPECT_NO_THROW(writeFile("/dev/null", "text"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  writeFile(path("a.txt"), "old");
  fs::create_symlink("a.txt", path("link"));
  writeFile(path("link"), "new");
  EXPECT_EQ(content(path("a.txt")), "new");
  EXPECT_TRUE(fs::is_symlink(path("link")));
}

TEST_F(OutputFileTest, SaysWhyThereIsNoFile) {
  try {
    writeFile(path("no/folder/a.txt"), "text");
    FAIL() << "written";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("No such file or directory"));
  }
}

TEST_F(OutputFileTest, FilesOfOneResultAppearTogether) {
  writeFile(path("a.txt"), "old a");
  fs::create_directory(path("folder"));
  writeFile(path("folder/old.txt"), "old");
  {
    OutputFiles files(folder_.path());
    writeFile(files.path("a.txt"), "new a");
    writeFile(files.path("b.txt"), "new b");
    fs::create_directory(files.path("folder"));
    EXPECT_EQ(content(path("a.txt")), "old a");
    EXPECT_FALSE(fs::exists(path("b.txt")));
    files.putInPlace();
  }
  EXPECT_EQ(content(path("a.txt")), "new a");
  EXPECT_EQ(content(path("b.txt")), "new b");
  EXPECT_TRUE(fs::is_empty(path("folder")));
  EXPECT_EQ(entries(), 3);
}

TEST_F(OutputFileTest, OfOneResultThatFailsNothingAppears) {
  writeFile(path("a.txt"), "old a");
  {
    OutputFiles files(folder_.path());
    writeFile(files.path("a.txt"), "new a");
    const FileSizeLimit limit(4096);
    EXPECT_THROW(writeFile(files.path("b.txt"), std::string(100'000, 'x')), DataError);
  }
  EXPECT_EQ(content(path("a.txt")), "old a");
  EXPECT_EQ(entries(), 1);
}

}  // namespace
}  // namespace etalon
