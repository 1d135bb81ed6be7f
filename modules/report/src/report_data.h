#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "etalon/benchmark/record.h"
#include "etalon/core/trajectory.h"

namespace etalon {

/**
 * What the report's scripts draw, as compact as it can be: names, statuses and reasons once each,
 * results as arrays that refer to them, numbers rounded to 6 digits, NaN as null, positions as
 * whole multiples of 10 um. Layout: see report/data.js, which reads it.
 */
nlohmann::json reportData(const BenchmarkRecord& record);

/** The whole trajectory of a run beside its ground truth, aligned in yaw and position where there
 * is any; thinned out to a few thousand poses. Times count from `first_image`. */
nlohmann::json trajectoryData(const Trajectory& odometry, const GroundTruth& ground_truth,
                              TimeNs first_image);

/** JSON that can stand inside a <script> element: valid UTF-8, no '<'. */
std::string scriptText(const nlohmann::json& json);

/** The text with its line ends, everything else as printable() says, and U+FFFD where it is no valid
 * UTF-8. */
std::string pageText(const std::string& text);

}  // namespace etalon
