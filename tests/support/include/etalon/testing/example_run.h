#pragma once

#include <filesystem>
#include <string>

#include "etalon/runlog/run_log.h"

namespace etalon::testing {

/** A folder of its own, removed at the end. */
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

constexpr TimeNs kFirstImage = 1403636584763555584;  // not a multiple of MRPT's tick

/** Every member filled with numbers that differ; one refused attempt, one accepted one. */
RunRecord exampleRecord();

/** The record with poses at 20 Hz for half a second, ground truth and references to images. */
RunLog exampleLog();

}  // namespace etalon::testing
