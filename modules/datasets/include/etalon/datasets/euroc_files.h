#pragma once

#include <string>
#include <vector>

#include "etalon/core/time.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

// The CSV files of EuRoC's (ASL) layout. Lines that start with '#', empty lines, CRLF and a byte
// order mark are passed over; stamps are whole nanoseconds that, but for the IMU's, increase strictly.

namespace etalon {

/**
 * 17 columns (stamp, position, quaternion w x y z, velocity, gyro bias, accelerometer bias) or the
 * first 8 of them, of the frame that the file describes.
 * @throws DataError naming the line, and if there are fewer than `min_states` of them
 */
GroundTruth readGroundTruthCsv(const std::string& path, size_t min_states = 0);

/**
 * 7 columns: stamp, angular rate [rad/s], specific force [m/s^2]. Numbers may be `nan` or `inf`:
 * what is no measurement is recognized by checkImu() and dropped by whoever uses the samples. Stamps
 * may come in any order; the samples are put into theirs, and one with the stamp of another is left
 * out.
 * @param warnings receive what was put right; null: nothing is said
 * @throws DataError naming the line, and if there are fewer than two samples
 */
std::vector<ImuSample> readImuCsv(const std::string& path,
                                  std::vector<std::string>* warnings = nullptr);

/** One stamp a line. @throws DataError naming the line, and if there is none */
std::vector<TimeNs> readStamps(const std::string& path);

}  // namespace etalon
