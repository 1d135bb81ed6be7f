#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "etalon/datasets/convert.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {

namespace fs = std::filesystem;

/** A source that a conversion reads whole. */
inline std::unique_ptr<SensorSource> openWhole(const std::string& path, bool decode = true) {
  SourceOptions options;
  options.imu_margin_s = 1e18;
  options.decode_images = decode;
  return openSource(path, options);
}

/** A EuRoC folder to convert, and where its log goes. */
class Rawlog : public ::testing::Test {
 protected:
  Rawlog() { writeTinyRecording(euroc); }

  ConvertReport convert(const std::string& destination, bool embed) const {
    ConvertOptions options;
    options.embed = embed;
    return convertToRawlog(*openWhole(euroc.string(), embed), destination, options);
  }

  TemporaryFolder folder;
  const fs::path euroc = folder / "recording";
  const std::string log = (folder / "log.rawlog").string();
};

}  // namespace etalon::testing
