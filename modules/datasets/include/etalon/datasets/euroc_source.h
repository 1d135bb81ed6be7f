#pragma once

#include <memory>
#include <string>

#include "etalon/datasets/recorded_source.h"

namespace etalon {

/**
 * Opens a folder in EuRoC's (ASL) layout, with or without ground truth:
 *
 *     [mav0/]cam0/{sensor.yaml, data.csv, data/<name>.png}, cam1/..., imu0/{sensor.yaml, data.csv},
 *     [state_groundtruth_estimate0/{data.csv, [sensor.yaml]}]
 *
 * With Kalibr's `camchain.yaml` beside cam0, that is the calibration of the cameras instead of their
 * `sensor.yaml` (docs/cameras.md).
 *
 * The body frame B is the IMU: T_BC = T_BS(imu0)^-1 T_BS(cam). Ground truth is brought to that
 * frame. Stamps stay exact to the nanosecond. Cameras are paired by equal stamps. A missing
 * `rate_hz` is measured from the stamps.
 *
 * @throws DataError naming file, line and what was expected
 */
std::unique_ptr<RecordedSource> openEuroc(const std::string& path,
                                          const SourceOptions& options = {});

}  // namespace etalon
