#include "visual_problem.h"

#include <cmath>

namespace etalon {

VisualProblem::VisualProblem(const VisualWindow& window, const std::vector<SE3>& T_WB,
                             const std::vector<Eigen::Vector3d>& landmarks)
    : window_(window), landmarks_(landmarks) {
  for (const SE3& T : T_WB) poses_.push_back(toBlock(T));
  for (const VisualMeasurement& m : window.measurements)
    costs_.emplace_back(window.T_CB[static_cast<size_t>(m.camera)], m.measurement);
}

std::unique_ptr<ceres::Problem> VisualProblem::makeProblem(const std::vector<char>& inlier,
                                                           double chi2_huber) {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  auto problem = std::make_unique<ceres::Problem>(options);
  loss_ = std::make_unique<ceres::HuberLoss>(std::sqrt(chi2_huber));
  for (PoseBlock& pose : poses_) problem->AddParameterBlock(pose.data(), 7, &manifold_);
  for (size_t i = 0; i < window_.measurements.size(); ++i) {
    if (!inlier[i]) continue;
    const VisualMeasurement& m = window_.measurements[i];
    problem->AddResidualBlock(&costs_[i], loss_.get(),
                              poses_[static_cast<size_t>(m.keyframe)].data(),
                              landmarks_[static_cast<size_t>(m.landmark)].data());
  }
  return problem;
}

ceres::Solver::Options VisualProblem::solverOptions(const ceres::Problem& problem,
                                                    const std::vector<double*>& others,
                                                    int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-5;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-9;
  // Landmarks first, then the poses, then the rest: a group of its own for each block, because
  // Ceres orders the blocks of a group by their addresses, which change with the state of the heap.
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Eigen::Vector3d& landmark : landmarks_)
    if (problem.HasParameterBlock(landmark.data())) ordering->AddElementToGroup(landmark.data(), 0);
  int group = 0;
  for (PoseBlock& pose : poses_) ordering->AddElementToGroup(pose.data(), ++group);
  for (double* block : others) ordering->AddElementToGroup(block, ++group);
  options.linear_solver_ordering = ordering;
  return options;
}

std::vector<SE3> VisualProblem::poses() const {
  std::vector<SE3> T_WB;
  for (const PoseBlock& pose : poses_) T_WB.push_back(fromBlock(pose.data()));
  return T_WB;
}

}  // namespace etalon
