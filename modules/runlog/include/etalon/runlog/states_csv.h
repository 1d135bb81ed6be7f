#pragma once

#include <string>
#include <vector>

#include "etalon/pipeline/frame_estimate.h"

namespace etalon {

/**
 * The causal estimates of a run as CSV, a line a frame: stamp (ns), state, position (m), quaternion
 * of T_WB, velocity in W (m/s), b_g (rad/s), b_a (m/s^2), and the standard deviation of each
 * (rotation about the body's axes in deg). A cell is empty where its value is not known.
 */
std::string statesCsv(const std::vector<FrameEstimate>& estimates);

/** The states at the IMU's rate as CSV, a line a sample: the first columns of statesCsv(), to the
 * velocity. */
std::string imuStatesCsv(const std::vector<ImuRateState>& states);

}  // namespace etalon
