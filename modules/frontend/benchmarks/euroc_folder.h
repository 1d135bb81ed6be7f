#pragma once

#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/trajectory.h"

namespace etalon {

/** What track_quality needs of a EuRoC folder: the least that does. Stamps are trusted to be in
 * order. */
struct EurocFolder {
  struct Gyro {
    TimeNs t = 0;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< rad/s, in B
  };
  struct Pair {
    TimeNs t = 0;
    std::string left_path, right_path;
  };

  StereoInertialCalibration calibration;
  std::vector<Pair> pairs;  ///< left and right of the same stamp
  std::vector<Gyro> gyro;
  GroundTruth ground_truth;

  /** @throws DataError for a missing file or a line that is not made of enough numbers */
  static EurocFolder read(const std::string& folder);

  /** R_B(from)B(to) by the midpoint rule, `bias` (rad/s) subtracted. */
  Eigen::Matrix3d rotation(TimeNs from, TimeNs to, const Eigen::Vector3d& bias) const;
};

}  // namespace etalon
