#pragma once

#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/core/refusal.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/normal_epipolar_bias.h"

namespace etalon {

/** Parameters of the gyro bias from normal epipolar constraints as a step of an initializer. */
struct NormalEpipolarStepOptions {
  NormalEpipolarBiasOptions solver;  ///< its sigma_px is the problem's
  double max_noise = 3.0;
  double max_sigma_gyro_rps = 0.02;
  double max_gyro_bias_rps = 0.5;

  void declare(ParameterSet& parameters);
};

/**
 * b_g from the problem's tracks by normal epipolar constraints (estimateGyroBias()).
 * @param preintegrations between neighbouring keyframes
 * @param seed of b_g, rad/s
 */
Expected<NormalEpipolarBias> solveNormalEpipolarStep(
    const InitializationProblem& problem, const std::vector<Preintegration>& preintegrations,
    const Eigen::Vector3d& seed, const NormalEpipolarStepOptions& options);

/**
 * The gyro bias that takes the integrated rotations nearest to those of `rotations`, R_WB one a
 * keyframe: one linear least-squares step on Log(dR_k^T R_k^T R_k+1).
 */
Eigen::Vector3d gyroBiasFromRotations(const std::vector<Eigen::Matrix3d>& rotations,
                                      const std::vector<Preintegration>& preintegrations);

}  // namespace etalon
