#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/optimization/solver_summary.h"
#include "imu_alignment.h"

namespace etalon::plugins {

/**
 * The linear solution taken on to the least reprojection error, rotations held: Gauss-Newton with
 * the landmarks eliminated (TrackInformation), alone or together with the IMU's equations. The
 * translation constraint has measured rays in its coefficients (errors in variables), so its
 * solution is off by the square of the pixels' noise; this one is not.
 */
class ReprojectionRefinement {
 public:
  /** @param R_VB rotations of the keyframes; outlives this */
  ReprojectionRefinement(const InitializationProblem& problem,
                         const std::vector<Eigen::Matrix3d>& R_VB);

  /**
   * @param imu nothing: positions alone
   * Converged is what comes to rest; its costs are not computed.
   */
  SolverSummary refine(const ImuAlignment* imu, int passes, LinearState* state);

  /** Landmarks that both cameras have seen at once. */
  int landmarks() const { return tracks_.validCount(); }

  /**
   * Covariance of the error in the order and the world of Initialization::covariance, of what
   * refine() has found with `imu`: of the pixels' noise, the IMU's (through the rotations, too),
   * the gyro bias and the prior on b_a.
   * @param gyro_bias covariance of b_g, (rad/s)^2; taken as independent of the pixels
   * @return empty if the system is singular
   */
  Eigen::MatrixXd covariance(const ImuAlignment& imu, const LinearState& state,
                             const Eigen::Matrix3d& gyro_bias);

 private:
  std::vector<SE3> poses(const LinearState& state) const;
  /** Adds the tracks' part; `factor` on their information. */
  void addTo(double factor, Eigen::MatrixXd* H, Eigen::VectorXd* gradient) const;

  const std::vector<Eigen::Matrix3d>& R_VB_;
  VisualWindow window_;
  StereoPoints points_;
  TrackInformation tracks_;
};

}  // namespace etalon::plugins
