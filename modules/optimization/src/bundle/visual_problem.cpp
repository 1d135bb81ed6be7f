#include "bundle/visual_problem.h"

#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>

namespace etalon {

VisualProblem::VisualProblem(const BundleProblem& bundle, const std::vector<SE3>& T_WB)
    : window_(bundle.window), landmarks_(bundle, T_WB) {
  for (const SE3& T : T_WB) poses_.push_back(toBlock(T));
  for (const VisualMeasurement& m : window_.measurements) {
    const size_t l = m.landmark;
    costs_.emplace_back(window_.T_CB[m.camera], m.measurement, landmarks_.landmarks[l],
                        landmarks_.held[l]);
  }
}

std::unique_ptr<ceres::Problem> VisualProblem::makeProblem(double huber) {
  return makeProblem(std::make_unique<ceres::HuberLoss>(huber));
}

std::unique_ptr<ceres::Problem> VisualProblem::makeProblem(
    std::unique_ptr<ceres::LossFunction> loss) {
  holdAtInfinity();
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  auto problem = std::make_unique<ceres::Problem>(options);
  loss_ = std::move(loss);
  for (PoseBlock& pose : poses_) problem->AddParameterBlock(pose.data(), 7, &manifold_);
  for (size_t i = 0; i < window_.measurements.size(); ++i) {
    const VisualMeasurement& m = window_.measurements[i];
    if (!m.inlier) continue;
    problem->AddResidualBlock(&costs_[i], loss_.get(), poses_[m.keyframe].data(),
                              landmarks_.landmarks[m.landmark].parameters.data());
  }
  return problem;
}

ceres::Solver::Options VisualProblem::solverOptions(const ceres::Problem& problem,
                                                    int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-5;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-9;
  // Landmarks first, then the poses: a group of its own for each, because Ceres orders the blocks of
  // a group by their addresses, which change with the state of the heap.
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (InverseDepthLandmark& landmark : landmarks_.landmarks)
    if (problem.HasParameterBlock(landmark.parameters.data()))
      ordering->AddElementToGroup(landmark.parameters.data(), 0);
  int group = 0;
  for (PoseBlock& pose : poses_) ordering->AddElementToGroup(pose.data(), ++group);
  options.linear_solver_ordering = ordering;
  return options;
}

std::vector<SE3> VisualProblem::poses() const {
  std::vector<SE3> T_WB;
  for (const PoseBlock& pose : poses_) T_WB.push_back(fromBlock(pose.data()));
  return T_WB;
}

void addRun(const ceres::Solver::Summary& run, SolverSummary* summary) {
  if (summary->termination == Termination::kNotStarted) summary->initial_cost = run.initial_cost;
  // The first entry is the evaluation at the start.
  if (!run.iterations.empty()) summary->iterations += run.iterations.size() - 1;
  summary->final_cost = run.final_cost;
  summary->message.clear();
  switch (run.termination_type) {
    case ceres::CONVERGENCE:
    case ceres::USER_SUCCESS:
      summary->termination = Termination::kConverged;
      break;
    case ceres::NO_CONVERGENCE:
      summary->termination = Termination::kMaxIterations;
      break;
    default:
      summary->stop(Termination::kFailed, run.message);
  }
}

}  // namespace etalon
