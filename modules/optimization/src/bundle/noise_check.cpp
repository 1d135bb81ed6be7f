#include "bundle/noise_check.h"

#include <algorithm>
#include <cmath>

namespace etalon {

namespace {

enum Group : Eigen::Index { kGyro, kAccel, kVision };

/** The leverage of the residuals. Adds the inertial part of the check as if no pixel were
 * truncated. */
double addResiduals(const std::vector<LinearizedResidual>& residuals, const Eigen::MatrixXd& P,
                    NoiseCheck* check) {
  double leverage = 0.0;
  for (const LinearizedResidual& a : residuals) {
    const Eigen::MatrixXd JP = timesCovariance(a, P);
    leverage += a.weight * timesTransposed(JP, a).trace();
    if (a.kind != ResidualKind::kImu) continue;
    for (const LinearizedResidual& b : residuals) {
      if (b.kind != ResidualKind::kImu) continue;
      Eigen::Matrix<double, 9, 9> R =  // block of I - H
          -std::sqrt(a.weight * b.weight) * timesTransposed(JP, b);
      if (&a == &b) {
        R.diagonal().array() += 1.0;
        check->gyro += {a.r.head<3>().squaredNorm(), R.diagonal().head<3>().sum()};
        check->accel += {a.r.tail<6>().squaredNorm(), R.diagonal().tail<6>().sum()};
      }
      check->coupling(kGyro, kGyro) += R.topLeftCorner<3, 3>().squaredNorm();
      check->coupling(kGyro, kAccel) += R.topRightCorner<3, 6>().squaredNorm();
      check->coupling(kAccel, kGyro) += R.bottomLeftCorner<6, 3>().squaredNorm();
      check->coupling(kAccel, kAccel) += R.bottomRightCorner<6, 6>().squaredNorm();
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
VisualResiduals collectVisual(const SolvedPixels& pixels) {
  VisualResiduals visual;
  for (size_t l = 0; l < pixels.landmarks.size(); ++l) {
    if (!pixels.landmarks[l].valid) continue;
    for (const VisualMeasurement& m : pixels.window.measurementsOf(l)) {
      Eigen::Vector2d r = Eigen::Vector2d::Zero();
      const bool seen =
          m.inlier && pixels.window.residual(m, pixels.T_WB, pixels.landmarks[l].position, &r);
      const double r2 = r.squaredNorm() / (pixels.sigma * pixels.sigma);
      visual.clipped += seen ? std::min(r2, pixels.chi2_pixel) : pixels.chi2_pixel;
      ++visual.all;
      visual.inliers += m.inlier;
    }
  }
  return visual;
}

}  // namespace

// The squared norm of a pair is exponential with mean 2 variance.

double truncationFactor(double chi2, int rounds) {
  const double s = 1.0 - std::exp(-0.5 * chi2) * (1.0 + 0.5 * chi2);
  const double p = 1.0 - std::exp(-0.5 * chi2);
  double of_psi = 0.0, of_r = 1.0;  // e = of_psi psi + of_r r
  for (int round = 1; round < rounds; ++round) {
    of_psi = (1.0 + (p - s) * of_psi) / p;
    of_r = (p - s) * of_r / p;
  }
  return p * (s * of_psi * (of_psi + 2.0 * of_r) + of_r * of_r);
}

double meanOfTruncatedPair(double variance, double bound) {
  const double mean = 2.0 * variance, x = bound / mean;
  if (x < 1e-4) return bound * (0.5 - x / 12.0);  // nearly uniform
  return x > 700.0 ? mean : mean - bound / std::expm1(x);
}

double meanOfClippedPair(double variance, double bound) {
  return -2.0 * variance * std::expm1(-bound / (2.0 * variance));
}

double varianceOfClippedPairs(double mean, double bound) {
  // Clipping lowers the mean, so half of it is too small. Above kMost it says almost nothing.
  constexpr double kMost = 100.0;
  double low = std::min(0.5 * mean, kMost), high = kMost;
  for (int i = 0; i < 60 && high - low > 1e-10 * low; ++i) {
    const double middle = 0.5 * (low + high);
    (meanOfClippedPair(middle, bound) < mean ? low : high) = middle;
  }
  return low;
}

NoiseCheck checkNoise(const SolvedPixels& pixels, const std::vector<LinearizedResidual>& residuals,
                      const Eigen::MatrixXd& covariance) {
  NoiseCheck check;
  const double leverage = addResiduals(residuals, covariance, &check);  // of all but vision

  // The leverages sum to the number of parameters.
  const VisualResiduals visual = collectVisual(pixels);
  const double parameters = static_cast<double>(covariance.rows() + pixels.landmark_unknowns);
  const double dof = 2.0 * visual.inliers - (parameters - leverage);
  if (!(dof > 0.0)) return {};
  // The fit leaves nearly the same share of the two numbers of every pair.
  const double redundancy = dof / (2.0 * visual.inliers);
  const double variance =
      varianceOfClippedPairs(visual.clipped / visual.all, pixels.chi2_pixel) / redundancy;
  check.vision = {variance * dof, dof};

  // (I - H) is a projection: a row of the coupling sums to the group's dof.
  Eigen::Matrix3d& C = check.coupling;
  C(kGyro, kVision) = std::max(0.0, check.gyro.dof - C.row(kGyro).sum());
  C(kAccel, kVision) = std::max(0.0, check.accel.dof - C.row(kAccel).sum());
  C.row(kVision).head<2>() = C.col(kVision).head<2>().transpose();
  C(kVision, kVision) = dof - C.row(kVision).sum();
  C.col(kVision).head<2>() *= 0.5 * meanOfTruncatedPair(1.0, pixels.chi2_pixel);
  check.gyro.dof = C.row(kGyro).sum();
  check.accel.dof = C.row(kAccel).sum();
  return check;
}

}  // namespace etalon
