#include "residual_redundancy.h"

#include <algorithm>
#include <cmath>

namespace etalon {

namespace {

enum Group : Eigen::Index { kGyro, kAccel, kVision };

/** Columns of state k, state k+1 and the biases. */
Eigen::Matrix<double, 9, 24> columns(const Eigen::Matrix<double, 9, Eigen::Dynamic>& M,
                                     Eigen::Index k) {
  Eigen::Matrix<double, 9, 24> picked;
  picked << M.middleCols<18>(9 * k), M.rightCols<6>();
  return picked;
}

/** Leverage of the inertial residuals, and their part of the check as if no pixel were truncated.
 */
double addInertial(const std::vector<InertialResidual>& inertial, const Eigen::MatrixXd& P,
                   NoiseCheck* check) {
  double leverage = 0.0;
  for (size_t k = 0; k < inertial.size(); ++k) {
    const InertialResidual& a = inertial[k];
    const Eigen::Index i = 9 * static_cast<Eigen::Index>(k);
    const Eigen::Matrix<double, 9, Eigen::Dynamic> JP =
        a.J.leftCols<18>() * P.middleRows<18>(i) + a.J.rightCols<6>() * P.bottomRows<6>();
    const double w2 = a.weight * a.weight;
    for (size_t l = 0; l < inertial.size(); ++l) {
      const InertialResidual& b = inertial[l];
      Eigen::Matrix<double, 9, 9> R =  // block of I - H
          -std::sqrt(a.weight * b.weight) * columns(JP, static_cast<Eigen::Index>(l)) *
          b.J.transpose();
      if (k == l) {
        leverage -= R.trace();
        R.diagonal().array() += 1.0;
        check->gyro += {w2 * a.r.head<3>().squaredNorm(), w2 * R.diagonal().head<3>().sum()};
        check->accel += {w2 * a.r.tail<6>().squaredNorm(), w2 * R.diagonal().tail<6>().sum()};
      }
      check->coupling(kGyro, kGyro) += w2 * R.topLeftCorner<3, 3>().squaredNorm();
      check->coupling(kGyro, kAccel) += w2 * R.topRightCorner<3, 6>().squaredNorm();
      check->coupling(kAccel, kGyro) += w2 * R.bottomLeftCorner<6, 3>().squaredNorm();
      check->coupling(kAccel, kAccel) += w2 * R.bottomRightCorner<6, 6>().squaredNorm();
    }
  }
  return leverage;
}

/** Sum of the inliers' squared residuals, their number and that of their landmarks. */
struct VisualResiduals {
  double chi2 = 0.0;
  int measurements = 0, landmarks = 0;
};

VisualResiduals collectVisual(const SolvedWindow& solved) {
  VisualResiduals visual;
  for (size_t l = 0; l < solved.landmarks.size(); ++l) {
    const int before = visual.measurements;
    for (int i = solved.window.first[l]; i < solved.window.first[l + 1]; ++i) {
      if (!solved.inlier[static_cast<size_t>(i)]) continue;
      const VisualMeasurement& m = solved.window.measurements[static_cast<size_t>(i)];
      Eigen::Vector2d r;
      if (!reprojectionResidual(solved.window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                solved.T_WB[static_cast<size_t>(m.keyframe)], solved.landmarks[l],
                                &r))
        continue;
      visual.chi2 += r.squaredNorm();
      ++visual.measurements;
    }
    if (visual.measurements > before) ++visual.landmarks;
  }
  return visual;
}

}  // namespace

double meanOfTruncatedPair(double variance, double bound) {
  // The squared norm is exponential with mean 2 variance.
  const double mean = 2.0 * variance, x = bound / mean;
  if (x < 1e-4) return bound * (0.5 - x / 12.0);  // nearly uniform
  return x > 700.0 ? mean : mean - bound / std::expm1(x);
}

double varianceOfTruncatedPairs(double mean, double bound) {
  // Truncation takes away, so half the mean is too small. Above kMost the mean says next to
  // nothing.
  constexpr double kMost = 100.0;
  double low = std::min(0.5 * mean, kMost), high = kMost;
  for (int i = 0; i < 60 && high - low > 1e-10 * low; ++i) {
    const double middle = 0.5 * (low + high);
    (meanOfTruncatedPair(middle, bound) < mean ? low : high) = middle;
  }
  return low;
}

NoiseCheck checkNoise(const SolvedWindow& solved, const std::vector<InertialResidual>& inertial,
                      const Eigen::MatrixXd& covariance) {
  NoiseCheck check;
  double leverage = addInertial(inertial, covariance, &check);  // of everything but vision
  const Eigen::Index bias = covariance.rows() - 6;
  leverage +=
      covariance.diagonal().segment<3>(bias).sum() / std::pow(solved.prior_sigma_gyro_rps, 2) +
      covariance.diagonal().segment<3>(bias + 3).sum() / std::pow(solved.prior_sigma_accel_mps2, 2);
  constexpr double kGauge = 4.0;  // its pseudo-measurements fit exactly
  leverage += kGauge;

  // The leverages sum to the number of parameters.
  const VisualResiduals visual = collectVisual(solved);
  const double parameters = static_cast<double>(covariance.rows()) + 3.0 * visual.landmarks;
  const double dof = 2.0 * visual.measurements - (parameters - leverage);
  if (!(dof > 0.0)) return {};
  // Of a pair's two numbers the fit leaves the same share everywhere, to good approximation.
  const double redundancy = dof / (2.0 * visual.measurements);
  const double variance =
      varianceOfTruncatedPairs(visual.chi2 / visual.measurements, solved.chi2_pixel) / redundancy;
  check.vision = {variance * dof, dof};

  // (I - H) is a projection: a row of the coupling sums to the group's dof.
  Eigen::Matrix3d& C = check.coupling;
  C(kGyro, kVision) = std::max(0.0, check.gyro.dof - C.row(kGyro).sum());
  C(kAccel, kVision) = std::max(0.0, check.accel.dof - C.row(kAccel).sum());
  C.row(kVision).head<2>() = C.col(kVision).head<2>().transpose();
  C(kVision, kVision) = dof - C.row(kVision).sum();
  C.col(kVision).head<2>() *= 0.5 * meanOfTruncatedPair(1.0, solved.chi2_pixel);
  check.gyro.dof = C.row(kGyro).sum();
  check.accel.dof = C.row(kAccel).sum();
  return check;
}

}  // namespace etalon
