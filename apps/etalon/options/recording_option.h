#pragma once

#include <CLI/CLI.hpp>

#include "etalon/datasets/sensor_source.h"

namespace etalon::app {

/** Declares what a recording does not say itself: --camchain, --imu-yaml, --pair-tolerance and the
 * topics of a bag. `options` must live until the command has run. */
void addRecordingOptions(CLI::App* command, RecordingOptions* options);

/** What SRC may be, for the help. */
constexpr const char* kSourceFormats = "EuRoC folder, .rawlog or ROS bag";

}  // namespace etalon::app
