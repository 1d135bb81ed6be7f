#include "recording_options.h"

#include "etalon/core/errors.h"

namespace etalon {

namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& format,
                         const std::string& what) {
  throw ConfigError(path + ": " + format + " has no use for " + what);
}

}  // namespace

void refuseTopicOptions(const RecordingOptions& options, const std::string& path,
                        const std::string& format) {
  for (const std::string& topic :
       {options.left_topic, options.right_topic, options.imu_topic, options.truth_topic})
    if (!topic.empty())
      refuse(path, format, "the topic '" + topic + "'; expected it with a bag only");
}

void refuseCalibrationOptions(const RecordingOptions& options, const std::string& path,
                              const std::string& format) {
  for (const std::string& file : {options.camchain, options.imu_yaml})
    if (!file.empty())
      refuse(path, format, "the calibration '" + file + "'; expected it with a folder or a bag");
  if (options.pair_tolerance_s != 0.0)
    refuse(path, format, "a tolerance of pairs; expected it with a folder or a bag");
}

}  // namespace etalon
