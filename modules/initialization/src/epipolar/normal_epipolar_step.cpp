#include "etalon/initialization/steps/normal_epipolar_step.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {

void NormalEpipolarStepOptions::declare(ParameterSet& parameters) {
  parameters.add("nec_pairs", &solver.all_pairs, {{"all", true}, {"consecutive", false}},
                 "Pairs of keyframes whose normal epipolar constraints give b_g: all, or "
                 "neighbours only (as published).");
  parameters.add("nec_cameras", &solver.both_cameras, {{"both", true}, {"left", false}},
                 "Cameras of these pairs: both, or the left one only (as published).");
  parameters.add("nec_weighting", &solver.noise_weighted, {{"noise", true}, {"none", false}},
                 "Smallest eigenvalue relative to the covariance of the normals, or as it is (as "
                 "published).");
  parameters.add(
      "nec_min_matches", &solver.min_matches, {5, 100000},
      "A pair that shares fewer landmarks in a camera is left out (published: 15). Refuse if "
      "neighbours share fewer in each camera.");
  parameters.add("nec_max_matches", &solver.max_matches, {5, 100000},
                 "Most matches used of a pair of keyframes that are not neighbours.");
  parameters.add("nec_rounds", &solver.rounds, {1, 1000},
                 "Rounds of reweighting at the end, at most (they take the place of RANSAC).");
  parameters.add("nec_restart_rps", &solver.restart_rps, {0.0, 10.0},
                 "Where the residuals are too large, the search is repeated from six points so far "
                 "from the seed, rad/s; 0: no repetition.");
  parameters.add("max_nec_noise", &max_noise, {0.0, 1e9},
                 "Refuse if the normals' residuals are larger than this many times what sigma_px "
                 "promises.");
  parameters.add("max_sigma_gyro_rps", &max_sigma_gyro_rps, {0.0, 1e9},
                 "Refuse if b_g is known worse in its worst direction (1 sigma), rad/s.");
  parameters.add("max_gyro_bias_rps", &max_gyro_bias_rps, {0.0, 100.0},
                 "Refuse if b_g is farther than this from the prior's mean, rad/s.");
}

Expected<NormalEpipolarBias> solveNormalEpipolarStep(
    const InitializationProblem& problem, const std::vector<Preintegration>& preintegrations,
    const Eigen::Vector3d& seed, const NormalEpipolarStepOptions& options) {
  NormalEpipolarBiasOptions solver = options.solver;
  solver.sigma_px = problem.sigmaPx();
  NormalEpipolarBias bias =
      estimateGyroBias(problem.calibration(), problem.keyframes(), preintegrations, seed, solver);
  if (bias.summary.termination == Termination::kNotStarted)
    return refuse(RefusalStatus::kTooFewTracks, "some neighbouring keyframes share ",
                  Value(bias.fewest_matches), " landmarks in a camera, at least ",
                  Bound(solver.min_matches), " are wanted");
  if (bias.summary.termination == Termination::kFailed)
    return refuse(RefusalStatus::kNotConverged,
                  "the gyro bias of the normal epipolar constraints is not finite after ",
                  Value(bias.summary.iterations), " iterations in rounds of ", solver.iterations);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(bias.covariance);
  const double sigma = std::sqrt(eigen.eigenvalues()(2));
  if (bias.summary.termination == Termination::kSingular || !(sigma <= options.max_sigma_gyro_rps))
    return refuse(RefusalStatus::kIllConditioned,
                  "the normal epipolar constraints know the gyro bias to ", Value(sigma, 4),
                  " rad/s (1 sigma, worst direction), at most ",
                  Bound(options.max_sigma_gyro_rps, 4), " is wanted: too little parallax");
  if (!(bias.noise <= options.max_noise))
    return refuse(RefusalStatus::kNotConverged, "the epipolar residuals are ", Value(bias.noise, 1),
                  " times what sigma_px promises, at most ", Bound(options.max_noise, 1),
                  " is wanted: a wrong minimum, or wrong tracks");
  const double distance = (bias.gyro - problem.priors().mean.gyro).norm();
  if (!(distance <= options.max_gyro_bias_rps))
    return refuse(RefusalStatus::kImplausible, "the gyro bias is ", Value(distance, 3),
                  " rad/s from its prior mean, at most ", Bound(options.max_gyro_bias_rps, 3),
                  " is plausible");
  return bias;
}

Eigen::Vector3d gyroBiasFromRotations(const std::vector<Eigen::Matrix3d>& rotations,
                                      const std::vector<Preintegration>& preintegrations) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < preintegrations.size(); ++k) {
    const Eigen::Matrix3d& J = preintegrations[k].dR_dbg();
    H += J.transpose() * J;
    b += J.transpose() * logSO3(preintegrations[k].deltas().dR.transpose() *
                                rotations[k].transpose() * rotations[k + 1]);
  }
  return preintegrations.front().bias().gyro + H.ldlt().solve(b);
}

}  // namespace etalon
