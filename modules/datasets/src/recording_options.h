#pragma once

#include <string>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

// Refusals of options that a format cannot use. `format` is what the recording is: "a rawlog".

/** @throws ConfigError if a topic is given */
void refuseTopicOptions(const RecordingOptions& options, const std::string& path,
                        const std::string& format);

/** @throws ConfigError if a calibration or a tolerance of pairs is given */
void refuseCalibrationOptions(const RecordingOptions& options, const std::string& path,
                              const std::string& format);

}  // namespace etalon
