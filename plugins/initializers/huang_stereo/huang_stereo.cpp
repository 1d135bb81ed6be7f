#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/combined_rows.h"
#include "hand_eye.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** The path of the left camera with the attitudes of the body that is found, in the frame of its
 * first one; where the body is, p_BC beside the camera, is not known yet. */
std::vector<SE3> cameraPath(const VisualSolution& visual, const SE3& T_BC, const Matrix3d& R_BC) {
  const SE3 T_VC0 = visual.T_VB[0] * T_BC;
  const Matrix3d R_VB0 = T_VC0.R * R_BC.transpose();
  std::vector<SE3> path;
  for (const SE3& T_VB : visual.T_VB) {
    const SE3 T_VC = T_VB * T_BC;
    path.emplace_back(R_VB0.transpose() * T_VC.R * R_BC.transpose(),
                      R_VB0.transpose() * (T_VC.t - T_VC0.t));
  }
  return path;
}

/** Errors of cameraPath(), 6(N-1) rows, from those of stereo odometry and of R_BC. */
MatrixXd pathErrors(const VisualSolution& visual, const SE3& T_BC, const HandEye& hand_eye,
                    const std::vector<SE3>& path) {
  const MatrixXd poses = hand_eye.errors->sources.poses();
  const MatrixXd& phi = hand_eye.rotation_errors;
  const Matrix3d R_found_known = hand_eye.R_BC * T_BC.R.transpose();
  const Matrix3d R_B0V = path[0].R * R_found_known * visual.T_VB[0].R.transpose();
  MatrixXd errors(poses.rows(), poses.cols());
  for (Index k = 0; k < poses.rows() / 6; ++k) {
    const auto rotation = poses.middleRows<3>(6 * k), position = poses.middleRows<3>(6 * k + 3);
    const SE3& at = path[k + 1];
    errors.middleRows<3>(6 * k) =
        R_found_known * rotation + (at.R.transpose() - Matrix3d::Identity()) * phi;
    errors.middleRows<3>(6 * k + 3) =
        R_B0V * (position - visual.T_VB[k + 1].R * hat(T_BC.t) * rotation) - hat(at.t) * phi;
  }
  return errors;
}

/** What p_BC adds to the rows of the pairs: the camera's path less that of the body. */
MatrixXd leverColumns(const std::vector<SE3>& path) {
  MatrixXd columns = MatrixXd::Zero(6 * (path.size() - 1), 3);
  for (size_t k = 0; k + 1 < path.size(); ++k)
    columns.middleRows<3>(6 * k) = path[k].R.transpose() * path[k + 1].R - Matrix3d::Identity();
  return columns;
}

}  // namespace

/**
 * Huang, Liu and Wan, T-RO 2020: gyro bias and the camera's rotation against the IMU together, then
 * gravity, b_a and the camera's place (README.md beside this file).
 */
class HuangStereo : public Initializer {
  DEFINE_MRPT_OBJECT(HuangStereo, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    options_.declare(parameters);
    parameters.add("translation", &free_translation_, {{"free", true}, {"calibration", false}},
                   "Where the camera is in the body: free, an unknown (as published), or that of "
                   "the calibration.");
    parameters.add("hand_eye_passes", &hand_eye_passes_, {1, 100},
                   "Solutions for b_g and the camera's rotation, at most.");
    parameters.add("max_sigma_rotation_deg", &max_sigma_rotation_deg_, {0.0, 180.0},
                   "Refuse if the standard deviation of the camera's rotation about an axis is "
                   "larger, deg.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const auto found = visualSolutionWith(problem, min_landmarks_);
    if (!found) return refuse(found.error());
    const VisualSolution& visual = **found;
    Stopwatch watch;
    const auto hand_eye = solveHandEye(problem, visual, options_.weighted, hand_eye_passes_);
    if (!hand_eye)
      return refuse(RefusalStatus::kIllConditioned, "the rotations of ",
                    Value(problem.keyframeCount()),
                    " keyframes do not determine the gyro bias and the camera's rotation");
    const double sigma_deg = degrees(hand_eye->sigma_rotation);
    if (!(sigma_deg <= max_sigma_rotation_deg_))
      return refuse(RefusalStatus::kIllConditioned,
                    "the camera's rotation in the body is known to ", Value(sigma_deg, 2),
                    " deg (1 sigma), at most ", Bound(max_sigma_rotation_deg_, 2),
                    " is wanted; turn about two axes");
    const double hand_eye_ms = watch.lapMilliseconds();
    const SE3& T_BC = problem.calibration().cameras[0].T_BC;
    VisualFrameEstimate at_camera;
    at_camera.T_VB = cameraPath(visual, T_BC, hand_eye->R_BC);
    at_camera.bias = hand_eye->bias;
    at_camera.errors = hand_eye->errors;
    if (at_camera.errors)
      at_camera.errors->poses = pathErrors(visual, T_BC, *hand_eye, at_camera.T_VB);
    VisualFrameEstimate estimate = at_camera;
    // Unweighted, errors of p_BC are of decimetres, and what they make of the rest is not linear.
    const bool linear = options_.weighted || !free_translation_;
    if (!linear) estimate.errors.reset();
    const auto p_BC = solveTranslation(problem, *hand_eye, options_, &estimate);
    if (!p_BC) return refuse(p_BC.error());
    // Landmarks go with the camera.
    const SE3 T_new_old =
        estimate.T_VB[0] * SE3(hand_eye->R_BC, *p_BC) * (visual.T_VB[0] * T_BC).inverse();
    for (const auto& [id, p_V] : visual.landmarks) estimate.landmarks[id] = T_new_old * p_V;
    Initialization result = alignWithGravity(problem, estimate);
    if (!linear && at_camera.errors) {
      CombinedRowsOptions weighted = options_;
      weighted.weighted = true;
      if (solveTranslation(problem, *hand_eye, weighted, &at_camera))
        result.covariance = covarianceAround(alignWithGravity(problem, at_camera), result);
    }
    result.T_BC = SE3(hand_eye->R_BC, *p_BC);
    result.timings = {{"hand_eye", hand_eye_ms}, {"triples", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** Gravity, b_a and p_BC from the triples; moves the poses from the camera to the body. */
  Expected<Vector3d> solveTranslation(const InitializationProblem& problem, const HandEye& hand_eye,
                                      const CombinedRowsOptions& options,
                                      VisualFrameEstimate* estimate) const {
    const std::vector<Preintegration>& pairs = hand_eye.preintegrations;
    const VisualFrameEstimate at_camera = *estimate;
    Vector3d p_BC = Vector3d::Zero();
    if (!free_translation_) p_BC = problem.calibration().cameras[0].T_BC.t;
    // Linear in p_BC; the second time its errors are those at the p_BC found.
    for (int pass = 0; pass < (free_translation_ ? 2 : 1); ++pass) {
      *estimate = at_camera;
      moveToBody(p_BC, MatrixXd(), estimate);
      const CombinedRows triples(problem, pairs, *estimate, triplesOfPairs(estimate->T_VB, pairs),
                                 free_translation_ ? leverColumns(estimate->T_VB) : MatrixXd());
      const auto change = solveCombinedRows(problem, triples, options, estimate);
      if (!change) return refuse(change.error());
      if (!free_translation_) continue;
      p_BC += change->x;
      moveToBody(change->x, change->errors, estimate);
      solveVelocities(pairs, nullptr, estimate);
    }
    return p_BC;
  }

  /** Takes positions, and their errors where they are known, from the end of a lever in the body to
   * its beginning. @param lever_errors empty: it is exact */
  static void moveToBody(const Vector3d& lever, const MatrixXd& lever_errors,
                         VisualFrameEstimate* estimate) {
    for (SE3& T_VB : estimate->T_VB) T_VB.t -= T_VB.R * lever;
    if (!estimate->errors) return;
    MatrixXd& errors = estimate->errors->poses;
    for (Index k = 0; k < errors.rows() / 6; ++k) {
      const Matrix3d& R_VB = estimate->T_VB[k + 1].R;
      auto position = errors.middleRows<3>(6 * k + 3);
      position += R_VB * hat(lever) * errors.middleRows<3>(6 * k);
      if (lever_errors.size() > 0) position -= (R_VB - Matrix3d::Identity()) * lever_errors;
    }
  }

  CombinedRowsOptions options_;
  bool free_translation_ = true;
  int hand_eye_passes_ = 10;
  double max_sigma_rotation_deg_ = 1.0;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(HuangStereo, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(HuangStereo, etalon::plugins, "huang_stereo", "1.0",
                            "gyro bias and camera-IMU rotation together, then gravity, b_a and the "
                            "camera's place (Huang et al. 2020)")
