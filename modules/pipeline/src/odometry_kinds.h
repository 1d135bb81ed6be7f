#pragma once

// What may run after the start, by its name in [odometry] kind. Private to the module.

#include <memory>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/odometry/fixed_lag/odometry.h"
#include "etalon/pipeline/pipeline_options.h"

namespace etalon {

/** Their names. */
std::vector<std::string> odometryKinds();

/** "fixed_lag (images and IMU, tightly coupled) or stereo_visual (images alone)". */
std::string odometryKindsInWords();

/** A new odometry of that kind; null where stereo odometry, which ran before the start, goes on.
 * @param views of the map; null without one */
std::unique_ptr<Odometry> makeOdometry(const StereoInertialCalibration& calibration,
                                       const PipelineOptions& options,
                                       std::shared_ptr<ViewMatcher> views);

}  // namespace etalon
