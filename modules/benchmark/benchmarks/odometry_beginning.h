#pragma once

// Where a comparison of odometries begins, and what is done to the tracks before it. For
// odometry_accuracy.

#include "etalon/benchmark/calibration/flight_over_tracks.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** Where the odometries begin. */
using Beginning = TracksStart;

/** The first frame with ground truth: its state, with errors as a good initialization has them. */
Beginning fromTruth(const SequenceTracks& tracks, unsigned seed);

/** The first window that the first initializer of the suite solves and that is accepted; the
 * odometries begin at its first keyframe. @throws DataError if there is none */
Beginning fromInitializer(const SequenceTracks& tracks, const SuiteConfiguration& suite);

/** From at_s after the first image on, for for_s seconds. */
struct OdometryFault {
  std::string kind;  ///< black, right, drop or imu; empty: none
  double at_s = 0.0, for_s = 0.0;
};

/**
 * black: no frame has observations, and afterwards every track is a new one; right: the right
 * camera sees nothing; drop: there are no frames, and afterwards every track is a new one; imu:
 * there are no samples.
 */
void injectFault(const OdometryFault& fault, SequenceTracks* tracks);

}  // namespace etalon
