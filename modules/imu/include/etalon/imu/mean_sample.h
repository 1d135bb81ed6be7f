#pragma once

#include <vector>

#include "etalon/imu/imu_sample.h"

namespace etalon {

/** Mean of rate and specific force; zero without samples. Stamp and saturation are not set. */
ImuSample meanSample(const std::vector<ImuSample>& samples);

}  // namespace etalon
