#pragma once

// What may run, by its name in [odometry] kind. Private to the module.

#include <memory>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/odometry/odometry.h"
#include "etalon/pipeline/pipeline_options.h"

namespace etalon {

/** Their names. */
std::vector<std::string> odometryKinds();

/** "fixed_lag (images and IMU, tightly coupled) or stereo_visual (images alone)". */
std::string odometryKindsInWords();

/** A new odometry of the kind of that name.
 * @param views of the map; null without one
 * @throws ConfigError if there is no such kind */
std::unique_ptr<Odometry> makeOdometry(const std::string& name,
                                       const StereoInertialCalibration& calibration,
                                       const PipelineOptions& options,
                                       const std::shared_ptr<ViewMatcher>& views = nullptr);

}  // namespace etalon
