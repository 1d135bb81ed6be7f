#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/optimization/residuals/reprojection_residual.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

/** A known point (m) and where one of the cameras saw it. */
struct PointMeasurement {
  Eigen::Vector3d p_W;
  int camera = 0;
  ReprojectionMeasurement measurement;
};

struct PoseOnlyOptions {
  int rounds = 4;  ///< relabelling rounds
  int iterations_per_round = 6;
  double chi2_threshold = 5.991;  ///< 95 %, 2 degrees of freedom
};

struct PoseOnlyResult {
  SolverSummary summary;
  SE3 T_WB;
  std::vector<char> inlier;  ///< one a measurement
  int inliers = 0;
};

/**
 * The pose of the body from known points (perspective-n-point on the calibrated stereo rig):
 * Gauss-Newton with Huber weights from `T_WB`, chi-square relabelling between rounds, no kernel in
 * the last round.
 */
PoseOnlyResult solvePoseOnly(const std::array<SE3, 2>& T_CB,
                             const std::vector<PointMeasurement>& measurements, const SE3& T_WB,
                             const PoseOnlyOptions& options = {});

}  // namespace etalon
