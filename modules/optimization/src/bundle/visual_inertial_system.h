#pragma once

// The unknowns, residuals and normal equations of visual-inertial BA. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "bundle/linearized_residual.h"
#include "bundle/slow_error.h"
#include "bundle/visual_equations.h"
#include "bundle/window_landmarks.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/** What visual-inertial BA solves for. */
struct VisualInertialUnknowns {
  std::vector<SE3> T_WB;
  std::vector<Eigen::Vector3d> v_WB;
  ImuBias bias;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< of the cameras in the body, rad
  std::vector<Eigen::Vector3d> shared;  ///< error that a keyframe's pixels share, rad, as the turn
  Eigen::VectorXd slow;  ///< of every mode of the slow error [x, y, z], in standard deviations
  WindowLandmarks landmarks;

  /** The bodies as the cameras see them: turned by `turn` and `shared`. */
  std::vector<SE3> seen() const;
};

/** Gauss-Newton's: H step = -g. */
struct StepEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double cost = 0.0;      ///< half the sum of the squares, with the losses
  double promised = 0.0;  ///< twice the decrease by what is eliminated, where the state stays
};

/**
 * Order of the state in the equations: [rotation, position, velocity] of every keyframe, [b_g, b_a],
 * turn, slow. Landmarks and shared errors are eliminated.
 *
 * Turns are small (hundredths of a rad at most): in derivatives a turn of the body is one of the
 * cameras.
 */
class VisualInertialSystem {
 public:
  /** Problem and options must outlive this. */
  VisualInertialSystem(const VisualInertialProblem& problem,
                       const VisualInertialBaOptions& options);

  VisualInertialUnknowns start() const;

  /** Linearises the pixels; decides which landmarks are held at infinity.
   * @param damping of the landmarks, relative to the diagonal */
  void linearizePixels(VisualInertialUnknowns* at, double damping = 0.0);
  /** Adds to the pixels, as linearised last, the other residuals at `at`: the lower triangle. */
  StepEquations equations(const std::vector<LinearizedResidual>& residuals) const;
  StepEquations linearize(VisualInertialUnknowns* at, double damping) {
    linearizePixels(at, damping);
    return equations(residuals(*at));
  }
  /** The unknowns after a step from where the pixels were linearised last. */
  VisualInertialUnknowns moved(const VisualInertialUnknowns& from,
                               const Eigen::VectorXd& step) const;

  /** Every residual of the state: what solver, covariance and noise check know of the problem but
   * for the pixels. A new residual is one line here. */
  std::vector<LinearizedResidual> residuals(const VisualInertialUnknowns& at) const;
  /** Information and curvature of the poses that the cameras see, by the inliers. */
  NormalEquations visualEquations(const VisualInertialUnknowns& at) const;
  /** The same of the state.
   * @param visual_share of what the inliers say that counts */
  NormalEquations normalEquations(NormalEquations visual, double visual_share,
                                  const std::vector<LinearizedResidual>& residuals) const;

  /** Takes another size of the accelerometer's errors. */
  void setSizes(const AccelErrorSizes& sizes) { sizes_ = sizes; }
  const AccelErrorSizes& sizes() const { return sizes_; }
  /** Standard deviation of the pixels over that of the window. */
  void setPixelShare(double share) { pixel_share_ = share; }
  double pixelShare() const { return pixel_share_; }

  Eigen::Index keyframes() const { return keyframes_; }
  Eigen::Index biasColumn() const { return 9 * keyframes_; }
  Eigen::Index turnColumn() const { return biasColumn() + 6; }
  Eigen::Index slowColumn() const { return turnColumn() + 3; }
  Eigen::Index slowCount() const { return 3 * slow_modes_.cols(); }
  Eigen::Index columns() const { return slowColumn() + slowCount(); }

 private:
  LinearizedResidual inertial(const VisualInertialUnknowns& at, size_t k, double white) const;
  const VisualInertialProblem& problem_;
  const VisualInertialBaOptions& options_;
  Eigen::Index keyframes_;
  double sigma_shared_rad_, sigma_turn_rad_;
  Eigen::MatrixXd slow_modes_;  ///< m/s^2, a row an interval, a column a mode
  double pixel_share_ = 1.0;
  AccelErrorSizes sizes_;
  VisualEquations visual_;
  StepEquations pixels_;  ///< of the state, shared errors eliminated
  // The shared errors after a move d of the poses are: before - shared_g_ - shared_H_ d.
  Eigen::VectorXd shared_g_;
  Eigen::MatrixXd shared_H_;
};

}  // namespace etalon
