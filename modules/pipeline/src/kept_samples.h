#pragma once

// Private to the module.

#include <optional>

#include "etalon/imu/imu_buffer.h"

namespace etalon {

/** The IMU tells of the motion across a gap of the frames of at most this length, s. */
constexpr double kLongestGapOfFramesS = 60.0;

/** Adds the sample to those kept since the last frame, of which there are no more than the longest
 * gap needs. */
void keepSample(const ImuSample& sample, const std::optional<TimeNs>& last_frame, ImuBuffer* imu);

}  // namespace etalon
