#include "epipolar/epipolar_bias_estimator.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "epipolar/epipolar_bias_covariance.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/optimization/residuals/cauchy.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMedianToSigma = 1.4826;  // of a normal distribution
constexpr double kTukeyWidth = 4.685;      // 95 % efficient on normal residuals
constexpr double kInlier = 4.0;            // standard deviations
constexpr double kConverged = 2e-5;        // rad/s, a fifth of what the gyro's noise allows in 2 s

/** Robust, from the median. Outliers inflate it, so it is taken again without those it shows. */
double robustSigma(std::vector<double> sizes) {
  if (sizes.empty()) return 0.0;
  const double limit = 3.0 * kMedianToSigma * median(sizes);
  sizes.erase(std::remove_if(sizes.begin(), sizes.end(), [&](double size) { return size > limit; }),
              sizes.end());
  return kMedianToSigma * median(std::move(sizes));
}

}  // namespace

EpipolarBiasEstimator::EpipolarBiasEstimator(const StereoInertialCalibration& calibration,
                                             const std::vector<const TrackedFrame*>& keyframes,
                                             const std::vector<Preintegration>& preintegrations,
                                             const NormalEpipolarBiasOptions& options)
    : calibration_(calibration),
      options_(options),
      preintegrations_(preintegrations),
      relative_(keyframes.size() * keyframes.size()) {
  for (size_t c = 0; c < 2; ++c) {
    R_BC_[c] = calibration.cameras[c].T_BC.R;
    sigma_rad_[c] = options.sigma_px / std::sqrt(calibration.cameras[c].model.focal().prod());
  }
  EpipolarPairs found = collectEpipolarPairs(calibration, keyframes, options);
  pairs_ = std::move(found.pairs);
  observations_ = found.observations;
  fewest_matches_ = found.fewest_matches;
}

Matrix3d EpipolarBiasEstimator::rotation(const EpipolarPair& pair) const {
  const Matrix3d& R_BC = R_BC_[pair.camera];
  return R_BC.transpose() * relative(pair).R * R_BC;
}

EpipolarCost EpipolarBiasEstimator::costOf(const EpipolarPair& pair, const Matrix3d& R) const {
  return rotation_only_ ? rotationOnlyCost(pair.moments, R, pair.N)
                        : smallestEigenvalueCost(pair.moments, R, pair.N);
}

void EpipolarBiasEstimator::integrateRotations(const Vector3d& b_g, int span) {
  const size_t n = preintegrations_.size() + 1;
  std::vector<Relative> steps;
  for (const Preintegration& p : preintegrations_) {
    const Vector3d moved = b_g - p.bias().gyro;
    const Vector3d turned = p.dR_dbg() * moved;
    steps.push_back({p.deltas().dR * expSO3(turned), rightJacobianSO3(turned) * p.dR_dbg()});
  }
  for (size_t i = 0; i + 1 < n; ++i) {
    Relative chain{Matrix3d::Identity(), Matrix3d::Zero()};
    for (size_t j = i + 1; j < std::min(n, i + 1 + static_cast<size_t>(span)); ++j) {
      const Relative& step = steps[j - 1];
      chain = {chain.R * step.R, step.R.transpose() * chain.dR_dbg + step.dR_dbg};
      relative_[i * n + j] = chain;
    }
  }
}

void EpipolarBiasEstimator::fillResiduals(EpipolarPair* pair, const Matrix3d& R,
                                          bool rotation_only) const {
  const double sigma = sigma_rad_[pair->camera];
  // So that the robust standard deviation is one here as well.
  const double rotation_scale = 1.0 / (kMedianToSigma * kRayleighMedian * std::sqrt(2.0) * sigma);
  const Vector3d& t = pair->direction;
  std::vector<double> sizes;
  sizes.reserve(pair->matches.size());
  for (EpipolarMatch& match : pair->matches) {
    const Vector3d g = R * match.f_j;
    const Vector3d n = match.f_i.cross(g);
    const double a = t.dot(match.f_i), b = t.dot(g);
    // A bearing along the translation says nothing of it: its residual is small whatever it is.
    match.residual = rotation_only
                         ? n.norm() * rotation_scale
                         : t.dot(n) / (sigma * std::sqrt(std::max(2.0 - a * a - b * b, 1e-3)));
    sizes.push_back(std::abs(match.residual));
  }
  pair->sigma = robustSigma(std::move(sizes));
}

bool EpipolarBiasEstimator::atRest() {
  const int span = longestSpan();
  const auto isOrHalves = [&](const EpipolarPair& pair, const EpipolarPair& longest) {
    const int middle = (longest.i + longest.j) / 2;
    return longest.j - longest.i == span &&
           ((pair.i == longest.i && (pair.j == longest.j || pair.j == middle)) ||
            (pair.i == middle && pair.j == longest.j));
  };
  constexpr double kNoise = 1.5;  // a movement of the noise's size is noticed
  return std::all_of(pairs_.begin(), pairs_.end(), [&](EpipolarPair& pair) {
    const bool looked_at =
        std::any_of(pairs_.begin(), pairs_.end(),
                    [&](const EpipolarPair& longest) { return isOrHalves(pair, longest); });
    if (!looked_at) return true;
    fillResiduals(&pair, Matrix3d::Identity(), true);
    return pair.sigma < kNoise;
  });
}

EpipolarBiasEstimator::Linearization EpipolarBiasEstimator::linearize(const Vector3d& b_g, int span,
                                                                      bool with_derivatives) {
  integrateRotations(b_g, span);
  Linearization sum;
  for (EpipolarPair& pair : pairs_) {
    if (pair.j - pair.i > span) break;
    const EpipolarCost cost = costOf(pair, rotation(pair));
    pair.direction = cost.direction;
    pair.certainty = cost.certainty;
    sum.cost += pair.factor * cost.value;
    if (!with_derivatives) continue;
    const Matrix3d A = R_BC_[pair.camera].transpose() * relative(pair).dR_dbg;
    sum.gradient += pair.factor * (A.transpose() * cost.gradient);
    sum.hessian += pair.factor * (A.transpose() * cost.hessian * A);
  }
  return sum;
}

void EpipolarBiasEstimator::fillMoments(EpipolarPair* pair, const Matrix3d& R,
                                        Weights weights) const {
  const double sigma = sigma_rad_[pair->camera];
  pair->moments.clear();
  for (EpipolarMatch& match : pair->matches) {
    double w = 0.0;
    if (weights != Weights::kTukey) {
      const double width = weights == Weights::kStart ? 1.0 : kCauchyWidth;
      const double x = match.residual / (width * std::max(1.0, pair->sigma));
      w = 1.0 / (1.0 + x * x);
    } else {
      const double x = match.residual / (kTukeyWidth * std::max(1.0, pair->sigma));
      w = std::abs(x) < 1.0 ? (1.0 - x * x) * (1.0 - x * x) : 0.0;
    }
    match.weight = w;
    if (w > 0.0) pair->moments.add(match.f_i, match.f_j, w);
  }
  if (options_.noise_weighted || rotation_only_) {
    pair->N = pair->moments.normalCovariance(R);
    pair->factor = pair->moments.weight() / (sigma * sigma);
  } else {
    pair->N.setIdentity();
    pair->factor = 1.0 / (2.0 * sigma * sigma);  // a normal has the noise of two bearings
  }
  if (weights == Weights::kStart) return;
  pair->factor /= std::max(1.0, pair->sigma * pair->sigma);
  if (options_.noise_weighted) pair->factor *= pair->certainty * pair->certainty;
}

void EpipolarBiasEstimator::reweight(const Vector3d& b_g, int span, Weights weights) {
  integrateRotations(b_g, span);
  for (EpipolarPair& pair : pairs_) {
    if (pair.j - pair.i > span) break;
    const Matrix3d R = rotation(pair);
    fillResiduals(&pair, R, rotation_only_ || weights == Weights::kStart);
    fillMoments(&pair, R, weights);
  }
}

Vector3d EpipolarBiasEstimator::round(const Vector3d& start, int span, Weights weights) {
  constexpr double kMoved = 1e-4;  // rad/s: the first order is then off by 1e-8 rad a second
  if ((start - preintegrations_.front().bias().gyro).norm() > kMoved)
    for (Preintegration& p : preintegrations_) p = p.reintegrated({start, p.bias().accel});
  reweight(start, span, weights);
  Vector3d b_g = start;
  Linearization at = linearize(b_g, span);
  if (weights == Weights::kStart) summary_.initial_cost = at.cost;
  double lambda = 1e-4;
  for (int k = 0; k < options_.iterations; ++k) {
    ++summary_.iterations;
    Matrix3d H = at.hessian;
    H.diagonal() *= 1.0 + lambda;
    const Vector3d step = H.ldlt().solve(-at.gradient);
    if (!step.allFinite()) break;
    const Linearization candidate = linearize(b_g + step, span);
    if (candidate.cost < at.cost) {
      b_g += step;
      at = candidate;
      lambda = std::max(0.1 * lambda, 1e-9);
    } else {
      lambda *= 10.0;
    }
    if (step.norm() < 0.1 * kConverged || lambda > 1e6) break;
  }
  return b_g;
}

Vector3d EpipolarBiasEstimator::solve(const Vector3d& seed) {
  const int longest = longestSpan();
  summary_.initial_cost = 0.0;
  summary_.termination = Termination::kMaxIterations;
  Vector3d b_g = round(seed, 1, Weights::kStart);
  for (const int span : {1, 1, 3}) b_g = round(b_g, std::min(span, longest), Weights::kCauchy);
  if (longest > 1) {
    // Longer pairs have no direction yet: one look at them first.
    reweight(b_g, longest, Weights::kStart);
    linearize(b_g, longest, false);
  }
  b_g = round(b_g, longest, Weights::kCauchy);
  // With outliers the weights follow the bias slowly, and the bias the weights.
  for (int k = 0; k < options_.rounds; ++k) {
    const Vector3d before = b_g;
    b_g = round(b_g, longest, Weights::kTukey);
    if (k == 0 || (b_g - before).norm() >= kConverged) continue;
    summary_.termination = Termination::kConverged;
    break;
  }
  reweight(b_g, longest, Weights::kTukey);
  return b_g;
}

double EpipolarBiasEstimator::noise(int span) const {
  std::vector<double> sigmas;
  for (const EpipolarPair& pair : pairs_)
    if (pair.j - pair.i <= span) sigmas.push_back(pair.sigma);
  return sigmas.empty() ? 0.0 : median(std::move(sigmas));
}

void EpipolarBiasEstimator::describe(NormalEpipolarBias* result) const {
  result->summary = summary_;
  int inliers = 0;
  for (const EpipolarPair& pair : pairs_) {
    result->matches += pair.matches.size();
    for (const EpipolarMatch& match : pair.matches)
      inliers += std::abs(match.residual) < kInlier * std::max(1.0, pair.sigma);
  }
  result->pairs = pairs_.size();
  result->inlier_share = static_cast<double>(inliers) / std::max(1, result->matches);
  result->rotation_only = rotation_only_;
}

Matrix3d EpipolarBiasEstimator::fillErrors(NormalEpipolarBias* result) {
  summary_.final_cost = linearize(result->gyro, longestSpan()).cost;
  const double sigma_px = options_.sigma_px * std::max(1.0, noise(longestSpan()));
  EpipolarBiasCovariance sum(calibration_, sigma_px, preintegrations_.size(), observations_);
  for (const EpipolarPair& pair : pairs_) {
    const Matrix3d R_CB = R_BC_[pair.camera].transpose();
    std::vector<Matrix3d> by_interval;
    for (int k = pair.i + 1; k < pair.j; ++k)
      by_interval.emplace_back(R_CB * relative(k, pair.j).R.transpose());
    by_interval.push_back(R_CB);
    sum.add(pair, rotation(pair), R_CB * relative(pair).dR_dbg, by_interval, rotation_only_);
  }
  result->errors = sum.errors();
  result->covariance = result->errors.covariance;
  for (size_t k = 0; k < preintegrations_.size(); ++k) {
    const Matrix3d& by_rotation = result->errors.by_rotations[k];
    result->covariance += by_rotation * preintegrations_[k].covariance().topLeftCorner<3, 3>() *
                          by_rotation.transpose();
  }
  return sum.information();
}

}  // namespace etalon
