#pragma once

#include <Eigen/Core>
#include <optional>

#include "etalon/core/trajectory.h"
#include "etalon/pipeline/window_initialization.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/**
 * The record of an attempt of the pipeline: the stages that it reached, with their errors where
 * `ground_truth` covers a keyframe; the times of stereo odometry, initializer and VI-BA, and then
 * those of the initializer's own stages.
 * @param gravity_mps2 magnitude of gravity that the run was configured with
 * @param gravity_direction_G see evaluateWindow()
 */
AttemptRecord makeAttemptRecord(
    const InitializationAttempt& attempt, double gravity_mps2, const GroundTruth& ground_truth,
    const std::optional<Eigen::Vector3d>& gravity_direction_G = std::nullopt);

}  // namespace etalon
