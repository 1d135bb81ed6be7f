#pragma once

// The visual part of a Ceres problem: pose blocks, landmark blocks, reprojection costs. Private to
// the module.

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <deque>
#include <memory>
#include <vector>

#include "bundle/window_landmarks.h"
#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/solver_summary.h"
#include "residuals/pose_manifold.h"
#include "residuals/reprojection_cost.h"

namespace etalon {

/**
 * Parameter blocks of a bundle problem and the costs between them. The problem must outlive it; its
 * inliers are read anew for every run.
 *
 * rho of a landmark may become negative while Ceres runs; between runs such a landmark is set to
 * infinity and held there (WindowLandmarks::holdAtInfinity).
 */
class VisualProblem {
 public:
  VisualProblem(const BundleProblem& bundle, const std::vector<SE3>& T_WB);
  VisualProblem(const VisualProblem&) = delete;  // Ceres and the costs hold addresses
  VisualProblem& operator=(const VisualProblem&) = delete;

  void holdAtInfinity() { landmarks_.holdAtInfinity(window_, poses()); }

  /** A fresh problem with the poses' manifolds and the costs of all inlier measurements.
   * @param huber its width in sigmas */
  std::unique_ptr<ceres::Problem> makeProblem(double huber);
  /** The same with another loss. */
  std::unique_ptr<ceres::Problem> makeProblem(std::unique_ptr<ceres::LossFunction> loss);

  /**
   * Solver options of every BA here: Levenberg-Marquardt, dense Schur complement, one thread.
   * @param problem from makeProblem()
   */
  ceres::Solver::Options solverOptions(const ceres::Problem& problem, int max_iterations);

  double* pose(size_t k) { return poses_[k].data(); }
  std::vector<SE3> poses() const;
  const WindowLandmarks& landmarks() const { return landmarks_; }

 private:
  const VisualWindow& window_;
  std::vector<PoseBlock> poses_;
  WindowLandmarks landmarks_;
  std::deque<ReprojectionCost> costs_;  ///< one a measurement; borrowed by the problems
  PoseManifold manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
};

/** Adds a run of Ceres to the summary of all rounds. */
void addRun(const ceres::Solver::Summary& run, SolverSummary* summary);

}  // namespace etalon
