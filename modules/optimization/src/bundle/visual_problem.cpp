#include "bundle/visual_problem.h"

#include <cmath>

namespace etalon {

VisualProblem::VisualProblem(const VisualWindow& window, const std::vector<SE3>& T_WB,
                             const std::vector<Eigen::Vector3d>& landmarks)
    : window_(window), held_(landmarks.size(), 0) {
  for (const SE3& T : T_WB) poses_.push_back(toBlock(T));
  landmarks_.reserve(landmarks.size());
  for (size_t l = 0; l < landmarks.size(); ++l) {
    const VisualMeasurement& m = window.measurements[static_cast<size_t>(window.first[l])];
    const SE3 T_WC = T_WB[static_cast<size_t>(m.keyframe)] *
                     window.T_CB[static_cast<size_t>(m.camera)].inverse();
    landmarks_.emplace_back(landmarks[l], T_WC.t);
  }
  for (const VisualMeasurement& m : window.measurements) {
    const auto l = static_cast<size_t>(m.landmark);
    costs_.emplace_back(window.T_CB[static_cast<size_t>(m.camera)], m.measurement, landmarks_[l],
                        held_[l]);
  }
}

void VisualProblem::holdAtInfinity(const std::vector<char>& inlier) {
  const std::vector<SE3> T_WB = poses();
  for (size_t l = 0; l < landmarks_.size(); ++l) {
    double& rho = landmarks_[l].parameters.z();
    held_[l] = 0;
    if (rho > 0.0) continue;
    rho = 0.0;
    double slope = 0.0;  // of half the sum of squares by rho
    for (int i = window_.first[l]; i < window_.first[l + 1]; ++i) {
      const VisualMeasurement& m = window_.measurements[static_cast<size_t>(i)];
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J;
      if (inlier[static_cast<size_t>(i)] &&
          reprojectionResidual(window_.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                               T_WB[static_cast<size_t>(m.keyframe)], landmarks_[l], &r, nullptr,
                               &J))
        slope += J.col(2).dot(r);
    }
    held_[l] = slope >= 0.0;
  }
}

std::unique_ptr<ceres::Problem> VisualProblem::makeProblem(const std::vector<char>& inlier,
                                                           double chi2_huber) {
  holdAtInfinity(inlier);
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
                              landmarks_[static_cast<size_t>(m.landmark)].parameters.data());
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
  for (InverseDepthLandmark& landmark : landmarks_)
    if (problem.HasParameterBlock(landmark.parameters.data()))
      ordering->AddElementToGroup(landmark.parameters.data(), 0);
  int group = 0;
  for (PoseBlock& pose : poses_) ordering->AddElementToGroup(pose.data(), ++group);
  for (double* block : others) ordering->AddElementToGroup(block, ++group);
  options.linear_solver_ordering = ordering;
  return options;
}

std::vector<Eigen::Vector3d> VisualProblem::positions() const {
  std::vector<Eigen::Vector3d> p_W;
  for (const InverseDepthLandmark& landmark : landmarks_) p_W.push_back(landmark.position());
  return p_W;
}

std::vector<SE3> VisualProblem::poses() const {
  std::vector<SE3> T_WB;
  for (const PoseBlock& pose : poses_) T_WB.push_back(fromBlock(pose.data()));
  return T_WB;
}

}  // namespace etalon
