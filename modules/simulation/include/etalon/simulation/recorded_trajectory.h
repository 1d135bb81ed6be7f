#pragma once

#include <Eigen/Core>

#include "etalon/core/trajectory.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

/**
 * A smooth flight along a recorded one: a uniform B-spline of degree 5 for the position and one for
 * the quaternion (normalised where it is read), each fitted to the rows by least squares.
 * Derivatives are those of the splines, hence exactly consistent; acceleration and angular rate are
 * three and four times continuously differentiable. The spline smooths: motion faster than about 1
 * / (2 knot_s) is left out.
 */
class SplineTrajectory : public SimulatedTrajectory {
 public:
  /**
   * @param recorded at least 10 rows over at least 10 knots (ConfigError otherwise); velocities and
   * biases are not used
   * @param knot_s distance of the knots, s, > 0
   */
  explicit SplineTrajectory(const GroundTruth& recorded, double knot_s = 0.05);

  TrajectoryState at(TimeNs t) const override;

  static constexpr int kDegree = 5;

 private:
  struct Local {
    Eigen::Index first;  // control point of the first non-zero basis function
    double u;            // in [0, 1] within the knot interval
  };
  Local locate(TimeNs t) const;
  void fit(const GroundTruth& recorded);

  double knot_s_;
  Eigen::Matrix<double, Eigen::Dynamic, 7> control_;  // rows [p_W, q_WB as x y z w]
};

/**
 * The rows of a recording themselves, interpolated by GroundTruth::at. For images that shall belong
 * to a recorded IMU: nothing is smoothed away. Velocity is the recording's where it has one, else a
 * central difference over 10 ms, as are acceleration and angular rate always.
 */
class InterpolatedTrajectory : public SimulatedTrajectory {
 public:
  /** At least two rows (ConfigError otherwise). */
  explicit InterpolatedTrajectory(GroundTruth recorded);

  /** Gaps of the recording are bridged, however long; recorded().at() tells where they are. */
  TrajectoryState at(TimeNs t) const override;

  const GroundTruth& recorded() const { return recorded_; }

 private:
  StampedState row(TimeNs t) const;

  GroundTruth recorded_;
};

}  // namespace etalon
