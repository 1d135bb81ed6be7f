#pragma once

// The visual part of a Ceres problem: pose blocks, landmark blocks, reprojection costs. Private to
// the module.

#include <deque>
#include <memory>
#include <vector>

#include "ceres_blocks.h"
#include "etalon/optimization/visual_window.h"

namespace etalon {

/** Parameter blocks of a window and the costs between them. The window must outlive it. */
class VisualProblem {
 public:
  VisualProblem(const VisualWindow& window, const std::vector<SE3>& T_WB,
                const std::vector<Eigen::Vector3d>& landmarks);

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
  const std::vector<Eigen::Vector3d>& landmarks() const { return landmarks_; }

 private:
  const VisualWindow& window_;
  std::vector<PoseBlock> poses_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::deque<ReprojectionCost> costs_;  ///< one a measurement; borrowed by the problems
  PoseManifold manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
};

}  // namespace etalon
