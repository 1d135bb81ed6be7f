#include "etalon/initialization/steps/normal_epipolar_bias.h"

#include <Eigen/Eigenvalues>

#include "epipolar/epipolar_bias_estimator.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/** Errors and summary; where the bias is of no use the latter says so. */
void fillErrors(EpipolarBiasEstimator* estimator, NormalEpipolarBias* result) {
  const Matrix3d information = estimator->fillErrors(result);
  estimator->describe(result);
  if (!result->gyro.allFinite() || !information.allFinite()) {
    result->summary.stop(Termination::kFailed, "the gyro bias is not finite");
    return;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(information, Eigen::EigenvaluesOnly);
  constexpr double kLeastInformation = 1e-12;  // relative
  if (!(eigen.eigenvalues()(0) > kLeastInformation * eigen.eigenvalues()(2)))
    result->summary.stop(Termination::kSingular, "the normals do not determine the gyro bias");
}

}  // namespace

NormalEpipolarBias estimateGyroBias(const StereoInertialCalibration& calibration,
                                    const std::vector<const TrackedFrame*>& keyframes,
                                    const std::vector<Preintegration>& preintegrations,
                                    const Vector3d& seed,
                                    const NormalEpipolarBiasOptions& options) {
  NormalEpipolarBias result;
  EpipolarBiasEstimator estimator(calibration, keyframes, preintegrations, options);
  result.fewest_matches = estimator.fewestMatches();
  if (result.fewest_matches < options.min_matches) {
    result.summary.stop(Termination::kNotStarted, "neighbouring keyframes share too few landmarks");
    return result;
  }
  if (estimator.atRest()) estimator.useRotationOnly();
  constexpr double kNoise = 1.5;  // larger residuals are not what sigma_px promises
  constexpr double kShare = 0.5;
  for (int start = 0; start < 7; ++start) {
    Vector3d from = seed;
    if (start > 0) from[(start - 1) / 2] += start % 2 ? options.restart_rps : -options.restart_rps;
    const Vector3d b_g = estimator.solve(from);
    NormalEpipolarBias found;
    found.gyro = b_g;
    found.restart = start;
    found.fewest_matches = estimator.fewestMatches();
    found.noise = estimator.noise(estimator.longestSpan());
    fillErrors(&estimator, &found);
    const bool better = start == 0 || (found.summary.usable() &&
                                       (!result.summary.usable() || found.noise < result.noise));
    if (better) result = found;
    if (!(options.restart_rps > 0.0) ||
        (result.summary.usable() && result.noise < kNoise && result.inlier_share > kShare))
      break;
  }
  return result;
}

}  // namespace etalon
