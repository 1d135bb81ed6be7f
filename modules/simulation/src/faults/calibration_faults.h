#pragma once

#include <cstdint>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/** The calibration with its errors. @throws ConfigError if a camera has no focal length to change */
StereoInertialCalibration faultyCalibration(StereoInertialCalibration calibration,
                                            const std::vector<Fault>& faults, std::uint64_t seed);

}  // namespace etalon
