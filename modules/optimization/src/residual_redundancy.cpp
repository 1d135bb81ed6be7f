#include "residual_redundancy.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace etalon {

namespace {

/** Adds one inertial residual to its two groups; returns its leverage in the fit, tr(w J P J^T). */
double addInertial(const InertialResidual& inertial, const Eigen::Matrix<double, 24, 24>& P,
                   NoiseCheck* check) {
  const Eigen::Matrix<double, 9, 24>& J = inertial.J;
  const Eigen::Matrix<double, 9, 1> leverage =
      inertial.weight * (J * P).cwiseProduct(J).rowwise().sum();
  const double w2 = inertial.weight * inertial.weight;
  check->gyro += {w2 * inertial.r.head<3>().squaredNorm(), w2 * (3.0 - leverage.head<3>().sum())};
  check->accel += {w2 * inertial.r.tail<6>().squaredNorm(), w2 * (6.0 - leverage.tail<6>().sum())};
  return leverage.sum();
}

/** P of state k, state k+1 and the biases out of the joint covariance. */
Eigen::Matrix<double, 24, 24> pairCovariance(const Eigen::MatrixXd& covariance, Eigen::Index k) {
  const Eigen::Index i = 9 * k, bias = covariance.rows() - 6;
  Eigen::Matrix<double, 24, 24> P;
  P << covariance.block<18, 18>(i, i), covariance.block<18, 6>(i, bias),
      covariance.block<6, 18>(bias, i), covariance.block<6, 6>(bias, bias);
  return P;
}

/** Inliers by the number of inliers of their landmark, and the sum of their squared residuals. */
struct VisualResiduals {
  std::map<int, int> count;  ///< measurements by the number of measurements of their landmark
  int measurements = 0, landmarks = 0;
  double chi2 = 0.0;
};

VisualResiduals collectVisual(const SolvedWindow& solved) {
  VisualResiduals visual;
  for (size_t l = 0; l < solved.landmarks.size(); ++l) {
    int count = 0;
    for (int i = solved.window.first[l]; i < solved.window.first[l + 1]; ++i) {
      if (!solved.inlier[static_cast<size_t>(i)]) continue;
      const VisualMeasurement& m = solved.window.measurements[static_cast<size_t>(i)];
      Eigen::Vector2d r;
      if (!reprojectionResidual(solved.window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                solved.T_WB[static_cast<size_t>(m.keyframe)], solved.landmarks[l],
                                &r))
        continue;
      visual.chi2 += r.squaredNorm();
      ++count;
    }
    if (count == 0) continue;
    visual.count[count] += count;
    visual.measurements += count;
    ++visual.landmarks;
  }
  return visual;
}

/**
 * Variance factor of the pixels by maximum likelihood: the inliers' squared residuals have the mean
 * that this variance gives to pairs truncated at the inlier threshold. A pair's own variance is its
 * redundancy; a landmark takes its three parameters in equal shares from its measurements, the
 * poses the rest in equal shares from all.
 */
double varianceOfTruncated(const VisualResiduals& visual, double dof, double bound) {
  double after_landmarks = 0.0;
  for (const auto& [n, count] : visual.count) after_landmarks += count * (2.0 - 3.0 / n);
  const double poses = dof / after_landmarks;
  const auto expected = [&](double variance) {
    double sum = 0.0;
    for (const auto& [n, count] : visual.count)
      sum += count * meanOfTruncatedPair(variance * poses * (1.0 - 1.5 / n), bound);
    return sum;
  };
  // Truncation takes away, so the plain ratio is too small. Above kMost pixels say next to nothing.
  constexpr double kMost = 100.0;
  double low = std::min(visual.chi2 / dof, kMost), high = kMost;
  for (int i = 0; i < 50 && high - low > 1e-9 * low; ++i) {
    const double middle = 0.5 * (low + high);
    (expected(middle) < visual.chi2 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double meanOfTruncatedPair(double variance, double bound) {
  // The squared norm is exponential with mean 2 variance.
  const double mean = 2.0 * variance, x = bound / mean;
  if (x < 1e-4) return 0.5 * bound;  // uniform; the next term is bound x / 12
  return x > 700.0 ? mean : mean - bound / std::expm1(x);
}

NoiseCheck checkNoise(const SolvedWindow& solved, const std::vector<InertialResidual>& inertial,
                      const Eigen::MatrixXd& covariance) {
  NoiseCheck check;
  double leverage = 0.0;  // of everything but vision
  for (size_t k = 0; k < inertial.size(); ++k)
    leverage += addInertial(inertial[k],
                            pairCovariance(covariance, static_cast<Eigen::Index>(k)), &check);
  const Eigen::Index bias = covariance.rows() - 6;
  leverage += covariance.diagonal().segment<3>(bias).sum() / std::pow(solved.prior_sigma_gyro_rps, 2);
  leverage +=
      covariance.diagonal().segment<3>(bias + 3).sum() / std::pow(solved.prior_sigma_accel_mps2, 2);
  constexpr double kGauge = 4.0;  // its pseudo-measurements fit exactly
  leverage += kGauge;

  // The leverages sum to the number of parameters.
  const VisualResiduals visual = collectVisual(solved);
  const double parameters = static_cast<double>(covariance.rows()) + 3.0 * visual.landmarks;
  const double dof = 2.0 * visual.measurements - (parameters - leverage);
  if (dof > 0.0)
    check.vision = {dof * varianceOfTruncated(visual, dof, solved.chi2_pixel), dof};
  return check;
}

}  // namespace etalon
