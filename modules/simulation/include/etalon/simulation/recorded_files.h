#pragma once

#include <string>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

// Readers of the files that a recorded flight comes in. Empty lines and lines that start with '#'
// are skipped; stamps must increase strictly. All throw DataError naming file, line and what was
// expected.

/** EuRoC's ground truth: stamp [ns], p_WB, q_WB (w x y z), and in the form of 17 columns v_WB, b_g,
 * b_a. At least 2 rows. */
GroundTruth readGroundTruthCsv(const std::string& path);

/** EuRoC's IMU data: stamp [ns], gyro (rad/s), accelerometer (m/s^2). At least 2 rows. */
std::vector<ImuSample> readImuCsv(const std::string& path);

/** One stamp [ns] a line; at least one. */
std::vector<TimeNs> readStamps(const std::string& path);

}  // namespace etalon
