#pragma once

#include <cstdint>
#include <memory>

#include "etalon/datasets/sensor_source.h"
#include "etalon/simulation/faults/fault_scenario.h"

namespace etalon {

/**
 * What `source` would deliver if the faults of the scenario had happened, made on the fly. The same
 * arguments give the same, bit for bit, whatever part of the recording the source delivers.
 *
 * The order in which faults are written means nothing; they act as they would happen: lens and
 * sensor (covered, blur, exposure, noise), camera (frozen), its cable (dropped, lost, every), stamps
 * (delay, jitter; an image's stamp stays at least a millisecond after that of the image before),
 * the clock of all. Instants count in the recording's time before the faults.
 *
 * calibration(), imageStamps(), groundTruth() and statistics() are those after the faults; the first
 * warning of the statistics says which faults were made. A frame
 * whose pixels were changed has no path; a frozen one has the path of the image that it repeats.
 * Images of the source are never written to. Where the source does not decode, nothing is done to
 * pixels.
 *
 * @param start_s the scenario's zero, s after the first image of the recording
 * @param seed of everything random
 * @throws ConfigError if no image would be left, or a camera has no focal length to falsify
 */
std::unique_ptr<SensorSource> withFaults(std::unique_ptr<SensorSource> source,
                                         const FaultScenario& scenario, double start_s,
                                         std::uint64_t seed);

}  // namespace etalon
