#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {

namespace fs = std::filesystem;

/** A EuRoC folder of a few images, to be spoilt and read. */
class EurocSource : public ::testing::Test {
 protected:
  EurocSource() { writeTinyRecording(folder.path()); }
  fs::path mav0(const std::string& name) const { return folder / "mav0" / name; }
  fs::path leftImage(int i) const {
    return mav0("cam0/data/" + std::to_string(frameStamp(i)) + ".png");
  }
  std::unique_ptr<RecordedSource> open(const SourceOptions& options = {}) const {
    return openRecording(folder.path(), options);
  }
  std::string openingError() const {
    return dataErrorOf([this] { open(); });
  }

  TemporaryFolder folder;
};

}  // namespace etalon::testing
