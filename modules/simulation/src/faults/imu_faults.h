#pragma once

#include <cstdint>
#include <vector>

#include "etalon/imu/imu_sample.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/** What bias jumps add at the instant `s`. */
ImuBias addedBias(const std::vector<Fault>& faults, double s, std::uint64_t seed);

/** Adds biases, then saturates. */
void applyImuFaults(const std::vector<Fault>& faults, double s, std::uint64_t seed,
                    ImuSample* sample);

}  // namespace etalon
