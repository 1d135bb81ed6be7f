#include "bundle/residual_redundancy.h"

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

/** Residuals of the pixels. */
struct VisualResiduals {
  double clipped = 0.0;  ///< sum over all of min(squared residual, bound)
  int all = 0, inliers = 0;
};

/** Of every landmark that has inliers. */
VisualResiduals collectVisual(const SolvedWindow& solved) {
  VisualResiduals visual;
  for (size_t l = 0; l < solved.landmarks.size(); ++l) {
    const auto first = static_cast<size_t>(solved.window.first[l]);
    const auto last = static_cast<size_t>(solved.window.first[l + 1]);
    int inliers = 0;
    for (size_t i = first; i < last; ++i) inliers += solved.inlier[i] != 0;
    if (inliers == 0) continue;
    for (size_t i = first; i < last; ++i) {
      const VisualMeasurement& m = solved.window.measurements[i];
      Eigen::Vector2d r;
      const bool seen = solved.inlier[i] &&
                        reprojectionResidual(
                            solved.window.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                            solved.T_WB[static_cast<size_t>(m.keyframe)], solved.landmarks[l], &r);
      visual.clipped += seen ? std::min(r.squaredNorm(), solved.chi2_pixel) : solved.chi2_pixel;
    }
    visual.all += static_cast<int>(last - first);
    visual.inliers += inliers;
  }
  return visual;
}

}  // namespace

// The squared norm of a pair is exponential with mean 2 variance.

double meanOfTruncatedPair(double variance, double bound) {
  const double mean = 2.0 * variance, x = bound / mean;
  if (x < 1e-4) return bound * (0.5 - x / 12.0);  // nearly uniform
  return x > 700.0 ? mean : mean - bound / std::expm1(x);
}

double meanOfClippedPair(double variance, double bound) {
  return -2.0 * variance * std::expm1(-bound / (2.0 * variance));
}

double varianceOfClippedPairs(double mean, double bound) {
  // Clipping takes away, so half the mean is too small. Above kMost the mean says next to nothing.
  constexpr double kMost = 100.0;
  double low = std::min(0.5 * mean, kMost), high = kMost;
  for (int i = 0; i < 60 && high - low > 1e-10 * low; ++i) {
    const double middle = 0.5 * (low + high);
    (meanOfClippedPair(middle, bound) < mean ? low : high) = middle;
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
  const double parameters = static_cast<double>(covariance.rows() + solved.landmark_unknowns);
  const double dof = 2.0 * visual.inliers - (parameters - leverage);
  if (!(dof > 0.0)) return {};
  // Of a pair's two numbers the fit leaves the same share everywhere, to good approximation.
  const double redundancy = dof / (2.0 * visual.inliers);
  const double variance =
      varianceOfClippedPairs(visual.clipped / visual.all, solved.chi2_pixel) / redundancy;
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
