#include <filesystem>

#include "bags/bag_reader.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "euroc/euroc_reader.h"
#include "rawlog/rawlog_reader.h"

namespace etalon {

namespace {

struct Format {
  const char* kind;      ///< SensorSource::kind()
  const char* expected;  ///< what its recordings are, in words
  bool (*accepts)(const std::string& path);
  std::unique_ptr<RecordingReader> (*open)(const std::string& path,
                                           const RecordingOptions& options);
};

template <typename Reader>
constexpr Format formatOf(const char* kind, const char* expected) {
  return {kind, expected, Reader::accepts,
          [](const std::string& path,
             const RecordingOptions& options) -> std::unique_ptr<RecordingReader> {
            return std::make_unique<Reader>(path, options);
          }};
}

/** The formats that can be read. The first one that accepts a path reads it. */
constexpr Format kFormats[] = {
    formatOf<BagReader>("rosbag", "a ROS bag"),
    formatOf<EurocReader>("euroc", "a EuRoC (ASL) folder"),
    formatOf<RawlogReader>("rawlog", "a .rawlog"),
};

}  // namespace

std::unique_ptr<RecordedSource> openRecording(const std::string& path,
                                              const SourceOptions& options) {
  std::string expected;
  for (const Format& format : kFormats) {
    if (format.accepts(path))
      return std::make_unique<RecordedSource>(path, format.kind,
                                              format.open(path, options.recording), options);
    expected += (expected.empty() ? "" : " or ") + std::string(format.expected);
  }
  throw DataError(path, 0, "there is no such recording; expected " + expected);
}

std::unique_ptr<SensorSource> openSource(const std::string& path, const SourceOptions& options) {
  return openRecording(path, options);
}

}  // namespace etalon
