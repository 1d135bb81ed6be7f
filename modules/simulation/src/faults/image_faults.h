#pragma once

#include <cstdint>
#include <vector>

#include "etalon/datasets/sensor_source.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/**
 * Covers, blurs, exposes and adds noise, in this order; a covered lens has no more than its own
 * noise. An image that is changed is a new one, and loses its path; an empty one stays empty.
 * @param index number of the pair in the recording, for what is random
 */
void applyImageFaults(const std::vector<Fault>& faults, double s, std::uint64_t seed, size_t index,
                      StereoFrame* frame);

}  // namespace etalon
