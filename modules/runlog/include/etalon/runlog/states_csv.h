#pragma once

#include <string>
#include <vector>

#include "etalon/pipeline/frame_estimate.h"

namespace etalon {

/**
 * Writes the causal estimates of a run as CSV, a line a frame: stamp (ns), state, position (m),
 * quaternion of T_WB, velocity in W (m/s), b_g (rad/s), b_a (m/s^2), and the standard deviation of
 * each (rotation about the body's axes in deg). A cell is empty where its value is not known.
 * @throws DataError if the file cannot be written
 */
void writeStatesCsv(const std::string& path, const std::vector<FrameEstimate>& estimates);

/**
 * Writes the states at the IMU's rate as CSV, a line a sample: the first columns of
 * writeStatesCsv(), to the velocity.
 * @throws DataError if the file cannot be written
 */
void writeImuStatesCsv(const std::string& path, const std::vector<ImuRateState>& states);

}  // namespace etalon
