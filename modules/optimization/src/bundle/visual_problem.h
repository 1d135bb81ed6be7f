#pragma once

// The visual part of a Ceres problem: pose blocks, landmark blocks, reprojection costs. Private to
// the module.

#include <deque>
#include <memory>
#include <vector>

#include "etalon/optimization/bundle/visual_window.h"
#include "residuals/ceres_blocks.h"

namespace etalon {

/**
 * Parameter blocks of a window and the costs between them. The window must outlive it.
 *
 * Landmarks are (a, b, rho) of InverseDepthLandmark about the place of the camera that saw them
 * first, as given. rho may become negative while Ceres runs; between runs such a landmark is set to
 * infinity and held there, until the residuals want it nearer (an active set for rho >= 0).
 */
class VisualProblem {
 public:
  VisualProblem(const VisualWindow& window, const std::vector<SE3>& T_WB,
                const std::vector<Eigen::Vector3d>& landmarks);
  VisualProblem(const VisualProblem&) = delete;  // Ceres and the costs hold addresses
  VisualProblem& operator=(const VisualProblem&) = delete;

  /** Sets rho >= 0 and decides which landmarks are held at infinity. */
  void holdAtInfinity(const std::vector<char>& inlier);

  /** A fresh problem with the poses' manifolds and the costs of all inlier measurements. */
  std::unique_ptr<ceres::Problem> makeProblem(const std::vector<char>& inlier, double chi2_huber);

  /**
   * Solver options of every BA here: Levenberg-Marquardt, dense Schur complement, one thread.
   * @param problem from makeProblem()
   * @param others all blocks of the problem besides poses and landmarks
   */
  ceres::Solver::Options solverOptions(const ceres::Problem& problem,
                                       const std::vector<double*>& others, int max_iterations);

  double* pose(int k) { return poses_[static_cast<size_t>(k)].data(); }
  std::vector<SE3> poses() const;
  const std::vector<InverseDepthLandmark>& landmarks() const { return landmarks_; }
  std::vector<Eigen::Vector3d> positions() const;
  /** Where true, rho is zero and no unknown. */
  const std::vector<char>& held() const { return held_; }

 private:
  const VisualWindow& window_;
  std::vector<PoseBlock> poses_;
  std::vector<InverseDepthLandmark> landmarks_;
  std::vector<char> held_;
  std::deque<ReprojectionCost> costs_;  ///< one a measurement; borrowed by the problems
  PoseManifold manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
};

}  // namespace etalon
