#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/optimization/solver_summary.h"
#include "imu_alignment.h"

namespace etalon::plugins {

/**
 * Refines the linear solution to the least reprojection error with the rotations held: Gauss-Newton
 * with the landmarks eliminated (TrackInformation), alone or together with the IMU's equations. The
 * translation constraint has measured rays in its coefficients (errors in variables), so its
 * solution has a bias that grows with the square of the pixel noise; the refined solution has not.
 */
class ReprojectionRefinement {
 public:
  /** @param R_VB rotations of the keyframes; must outlive this object */
  ReprojectionRefinement(const InitializationProblem& problem,
                         const std::vector<Eigen::Matrix3d>& R_VB);

  /**
   * Converges when the positions stand still. Costs are not computed.
   * @param imu null: only the positions are refined
   */
  SolverSummary refine(const ImuAlignment* imu, int passes, LinearState* state);

  /** Number of landmarks that both cameras have seen in one frame. */
  int landmarks() const { return tracks_.validCount(); }

  /**
   * Covariance of the error of what refine() has found with `imu`, by the tracks of its last pass, in
   * the order and the world of Initialization::covariance. Its sources are the noise of pixels and IMU (through the rotations,
   * too), the gyro bias and the prior on b_a, whether that is estimated or held.
   * @param gyro_bias covariance of b_g, (rad/s)^2; b_g counts as independent of the pixels
   * @return empty if the system is singular
   */
  Eigen::MatrixXd covariance(const ImuAlignment& imu, const LinearState& state,
                             const Eigen::Matrix3d& gyro_bias) const;

  /** How the positions of keyframes 1.. that refine() has found without `imu` err. */
  struct PositionErrors {
    Eigen::MatrixXd covariance;   ///< by the pixels, of [rotation, position], rotations exact
    Eigen::MatrixXd by_rotation;  ///< 3(N-1) x 3(N-1), m/rad
  };
  /** @return nothing if the tracks do not determine the positions */
  std::optional<PositionErrors> positionErrors() const;

 private:
  std::vector<SE3> poses(const LinearState& state) const;
  /** Adds the tracks' part, its information multiplied by `factor`. */
  void addTo(double factor, Eigen::MatrixXd* H, Eigen::VectorXd* gradient) const;

  const std::vector<Eigen::Matrix3d>& R_VB_;
  VisualWindow window_;
  StereoPoints points_;
  TrackInformation tracks_;
};

}  // namespace etalon::plugins
