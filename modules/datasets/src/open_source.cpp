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

/** What a file of that name should be, as far as no format accepts it. */
std::string expectedByName(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".bag") return "a ROS 1 bag, which begins with '#ROSBAG V2.0'";
  if (extension == ".db3") return "a ROS 2 bag of sqlite3";
  return "a ROS bag (.bag, or ROS 2's .db3 or its folder), a EuRoC (ASL) folder or a .rawlog";
}

}  // namespace

bool isRecording(const std::string& path) {
  for (const Format& format : kFormats)
    if (format.accepts(path)) return true;
  const std::string extension = std::filesystem::path(path).extension().string();
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored) &&
         (extension == ".rawlog" || extension == ".bag" || extension == ".db3" ||
          extension == ".mcap");
}

std::unique_ptr<RecordedSource> openRecording(const std::string& path,
                                              const SourceOptions& options) {
  RecordingOptions recording = options.recording;
  if (!options.ground_truth.empty()) recording.own_truth = false;
  std::string expected;
  for (const Format& format : kFormats) {
    if (format.accepts(path))
      return std::make_unique<RecordedSource>(path, format.kind, format.open(path, recording),
                                              options);
    expected += (expected.empty() ? "" : " or ") + std::string(format.expected);
  }
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw DataError(path, 0,
                    "is no recording; expected a EuRoC (ASL) folder with cam0, cam1 and imu0, or a "
                    "ROS 2 bag with its metadata.yaml");
  if (!std::filesystem::is_regular_file(path, ignored))
    throw DataError(path, 0, "there is no such recording; expected " + expected);
  if (std::filesystem::file_size(path, ignored) == 0)
    throw DataError(path, 0, "the file is empty; expected " + expectedByName(path));
  if (std::filesystem::path(path).extension() == ".mcap")
    throw DataError(path, 0, "MCAP is not read; `ros2 bag convert` makes a bag of sqlite3 of it");
  throw DataError(path, 0, "is no recording; expected " + expectedByName(path));
}

std::unique_ptr<SensorSource> openSource(const std::string& path, const SourceOptions& options) {
  return openRecording(path, options);
}

}  // namespace etalon
