#pragma once

#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_buffer.h"
#include "flight_model.h"

namespace etalon::ground_truth {

/**
 * The smoothed states at the IMU's stamps, in a world with z up along gravity. Between two nodes the
 * IMU carries the first one's state; what it misses the second one by is spread linearly.
 * @param max_gap_s between nodes further apart there are no states
 */
GroundTruth correctedStates(const std::vector<Node>& nodes, const Shared& shared,
                            const ImuBuffer& imu, double max_gap_s);

}  // namespace etalon::ground_truth
