#pragma once

#include "etalon/core/refusal.h"
#include "etalon/core/trajectory.h"
#include "etalon/evaluation/metrics.h"

namespace etalon {

/** A trajectory against a ground truth whose stamps may be of another clock. */
struct TimeShift {
  /** A row of the ground truth stamped t shows the estimate at t + shift: negative where the ground
   * truth comes late. */
  double shift_s = 0.0;
  double sigma_s = 0.0;            ///< standard error
  TrajectoryErrors before, after;  ///< ATE aligned in SE(3), over the same poses, without and with
};

/**
 * The shift of least ATE: least squares of the positions over shift, rotation and translation. The
 * standard error is that of leaving out one of ten parts of the trajectory after the other, since
 * its errors are correlated.
 * @return refused if the ground truth covers fewer than 30 poses, or if they hardly move, or so
 * evenly (straight or in a circle, at a constant speed) that a shift is the same as an alignment
 */
Expected<TimeShift> estimateTimeShift(const Trajectory& estimate, const GroundTruth& ground_truth);

}  // namespace etalon
