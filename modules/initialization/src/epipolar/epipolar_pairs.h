#pragma once

// The pairs of views whose normal epipolar constraints determine the gyro bias. Private to the
// module.

#include <Eigen/Core>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/initialization/steps/normal_epipolar.h"
#include "etalon/initialization/steps/normal_epipolar_bias.h"

namespace etalon {

/** One landmark in two views of one camera: unit bearings. */
struct EpipolarMatch {
  int observation_i = 0, observation_j = 0;  ///< numbers of the two, for what several pairs share
  Eigen::Vector3d f_i, f_j;
  double residual = 0.0;  ///< in standard deviations
  double weight = 0.0;    ///< in the moments
};

/** One camera at two keyframes. */
struct EpipolarPair {
  int i = 0, j = 0, camera = 0;
  std::vector<EpipolarMatch> matches;
  EpipolarMoments moments;
  Eigen::Matrix3d N = Eigen::Matrix3d::Identity();
  double certainty = 1.0;
  double factor = 1.0;  ///< from the pair's cost to squared standard deviations
  double sigma = 1.0;   ///< robust, of the residuals
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

/** The pairs of a window. */
struct EpipolarPairs {
  std::vector<EpipolarPair> pairs;  ///< by increasing span j - i
  int observations = 0;             ///< their numbers are below that
  int fewest_matches = 0;           ///< of a pair of neighbours, in the camera that sees more
};

/**
 * The pairs that `options` ask for, each with its matches. Pairs with fewer than min_matches are
 * left out.
 *
 * @param keyframes N >= 2; observations in increasing order of id
 */
EpipolarPairs collectEpipolarPairs(const StereoInertialCalibration& calibration,
                                   const std::vector<const TrackedFrame*>& keyframes,
                                   const NormalEpipolarBiasOptions& options);

}  // namespace etalon
