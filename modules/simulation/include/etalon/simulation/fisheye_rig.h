#pragma once

#include "etalon/core/calibration.h"

namespace etalon {

/**
 * EuRoC's rig with fisheye cameras of 512 x 512 px, 154 degrees from side to side and 218 from
 * corner to corner: equidistant, intrinsics of the size of those of the TUM VI benchmark (Schubert
 * et al., The TUM VI Benchmark for Evaluating Visual-Inertial Odometry, IROS 2018).
 */
StereoInertialCalibration fisheyeCalibration();

}  // namespace etalon
