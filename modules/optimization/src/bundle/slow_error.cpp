#include "bundle/slow_error.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "etalon/optimization/variance_components.h"

namespace etalon {

Eigen::MatrixXd slowErrorModes(const std::vector<Preintegration>& preintegrations,
                               const SlowAcceleration& slow) {
  constexpr double kLeastVariance = 1e-3;  // of the largest mode's
  const Eigen::Index n = preintegrations.size();
  if (!(slow.sigma_mps2 > 0.0) || n == 0) return Eigen::MatrixXd(n, 0);
  const auto middle = [&](Eigen::Index k) {
    return secondsBetween(preintegrations.front().start(), preintegrations[k].start()) +
           0.5 * preintegrations[k].dt();
  };
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index l = 0; l < n; ++l)
      correlation(k, l) = slow.correlation(middle(k) - middle(l));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(correlation);
  const Eigen::VectorXd& variance = modes.eigenvalues();  // in increasing order
  const Eigen::Index kept =
      (variance.array() > kLeastVariance * variance[n - 1]).cast<Eigen::Index>().sum();
  return slow.sigma_mps2 * modes.eigenvectors().rightCols(kept) *
         variance.tail(kept).cwiseSqrt().asDiagonal();
}

AccelErrorSizes scoredSizes(const AccelErrorSizes& now,
                            const std::vector<LinearizedResidual>& residuals,
                            const Eigen::MatrixXd& P, const Eigen::VectorXd& modes,
                            Eigen::Index column, const SlowAcceleration& slow, double jolt_spread) {
  // With H the hat matrix, d(-2 log L)/dt of a group is its dof, tr(I - H), less its chi2; of
  // covariance 2 |(I - H)_gh|^2. The white noise of the window is the group of all intervals.
  enum { kSlow, kWhite, kJolts };
  const Eigen::Index n = modes.size(), intervals = now.jolts.size();
  const Eigen::MatrixXd left =
      Eigen::MatrixXd::Identity(n, n) - P.block(column, column, n, n);  // I - H of the modes
  Eigen::VectorXd score(kJolts + intervals);
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(score.size(), score.size());
  score(kSlow) = 0.5 * (modes.squaredNorm() - left.trace());
  known(kSlow, kSlow) = 0.5 * left.squaredNorm();
  Eigen::Index k = kJolts;
  for (const LinearizedResidual& a : residuals) {
    if (a.kind != ResidualKind::kImu) continue;
    const double w2 = a.weight * a.weight;
    const Eigen::MatrixXd JP = timesCovariance(a, P).bottomRows<6>();
    score(k) = 0.5 * w2 * (a.r.tail<6>().squaredNorm() - 6.0);
    known(kSlow, k) = 0.5 * w2 * a.weight * JP.middleCols(column, n).squaredNorm();
    Eigen::Index l = kJolts;
    for (const LinearizedResidual& b : residuals) {
      if (b.kind != ResidualKind::kImu) continue;
      Eigen::Matrix<double, 6, 6> R =
          -std::sqrt(a.weight * b.weight) * timesTransposed(JP, b).rightCols<6>();
      if (&a == &b) {
        score(k) -= 0.5 * w2 * R.trace();
        R.diagonal().array() += 1.0;
      }
      known(k, l++) = 0.5 * a.weight * b.weight * R.squaredNorm();
    }
    ++k;
  }
  score(kWhite) = score.tail(intervals).sum();
  known.col(kSlow).tail(intervals) = known.row(kSlow).tail(intervals).transpose();
  known.row(kWhite) = known.bottomRows(intervals).colwise().sum();
  known(kWhite, kWhite) = known.row(kWhite).tail(intervals).sum();
  known.col(kWhite) = known.row(kWhite).transpose();

  Eigen::VectorXd sizes(score.size()), spread(score.size());
  sizes << now.slow, now.white, now.jolts;
  spread << slow.spread, slow.white_spread, Eigen::VectorXd::Constant(intervals, jolt_spread);
  sizes.array() *= scoredFactors(score, known, sizes, spread).array();
  AccelErrorSizes next(intervals);
  next.slow = sizes(kSlow);
  next.white = sizes(kWhite);
  next.jolts = sizes.tail(intervals).cwiseMax(1.0);
  return next;
}

}  // namespace etalon
