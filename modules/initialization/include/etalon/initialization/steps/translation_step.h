#pragma once

#include <optional>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/translation_ba.h"

namespace etalon {

/** Parameters of the decoupled translation step; defaults of Stereo-NEC and ETA. */
struct TranslationStepOptions {
  TranslationBaOptions ba;
  int min_inliers = 15;

  void declare(ParameterSet& parameters);
};

/** Poses, velocities and gravity in V. */
struct TranslationStep {
  VisualFrameEstimate estimate;
  double translation_ms = 0.0, alignment_ms = 0.0;
};

/** R_WB(0) as given, then R_WB(k) = R_WB(k-1) dR_k(b_g): the gyro with its bias removed. */
std::vector<Eigen::Matrix3d> integrateRotations(const Eigen::Matrix3d& R_WB0,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias);

/**
 * Errors of poses, 6(N-1) rows, whose rotations are the gyro's, integrated: they have its noise and
 * what b_g is off. The positions have been found best at the rotations of the errors' sources, and
 * move with those that replace them.
 * @param position_by_rotation 3(N-1) x 3(N-1), m/rad
 */
Eigen::MatrixXd gyroPoseErrors(const std::vector<Preintegration>& preintegrations,
                               const Eigen::MatrixXd& position_by_rotation,
                               const StateErrors& errors);

/**
 * Step 3 of ETA and Stereo-NEC (Wang et al., ICRA 2024): the rotations of stereo odometry are
 * replaced by the gyro's with `bias` removed, the translations found by 3-DoF bundle adjustment,
 * then velocities and gravity anew by weighted linear least squares on the new poses.
 *
 * @param preintegrations between neighbouring keyframes
 * @param g_V_seed gravity's direction in V, where its refinement starts
 * @param bias_errors those of `bias`; with them the estimate has its own
 */
Expected<TranslationStep> solveTranslationStep(const InitializationProblem& problem,
                                               const std::vector<Preintegration>& preintegrations,
                                               const ImuBias& bias, const Eigen::Vector3d& g_V_seed,
                                               const TranslationStepOptions& options,
                                               const std::optional<StateErrors>& bias_errors = {});

}  // namespace etalon
