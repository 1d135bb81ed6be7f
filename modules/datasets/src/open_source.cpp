#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/datasets/euroc_source.h"
#include "etalon/datasets/rawlog_source.h"

namespace etalon {

std::unique_ptr<RecordedSource> openRecording(const std::string& path,
                                              const SourceOptions& options) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return openEuroc(path, options);
  if (std::filesystem::is_regular_file(path, error)) return openRawlog(path, options);
  throw DataError(path, 0,
                  "there is no such recording; expected a EuRoC (ASL) folder or a .rawlog");
}

std::unique_ptr<SensorSource> openSource(const std::string& path, const SourceOptions& options) {
  return openRecording(path, options);
}

}  // namespace etalon
