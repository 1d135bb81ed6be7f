#include "bundle/slow_error.h"

#include <cmath>

#include "etalon/core/symmetric.h"

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
  const SymmetricEigen modes = symmetricEigen(correlation);
  const Eigen::VectorXd& variance = modes.values;  // in increasing order
  const Eigen::Index kept =
      (variance.array() > kLeastVariance * variance[n - 1]).cast<Eigen::Index>().sum();
  return slow.sigma_mps2 * modes.vectors.rightCols(kept) *
         variance.tail(kept).cwiseSqrt().asDiagonal();
}

AccelErrorSizes scoredSizes(const AccelErrorSizes& now,
                            const std::vector<LinearizedResidual>& residuals,
                            const Eigen::MatrixXd& P, const Eigen::VectorXd& modes,
                            Eigen::Index column, const SlowAcceleration& slow) {
  // With H the hat matrix, d(-2 log L)/dt of a group is its dof, tr(I - H), less its chi2; of
  // covariance 2 |(I - H)_gh|^2.
  enum { kSlow, kIntervals };
  const Eigen::Index n = modes.size();
  const Eigen::MatrixXd left =
      Eigen::MatrixXd::Identity(n, n) - P.block(column, column, n, n);  // I - H of the modes
  Eigen::VectorXd score(kIntervals + now.jolts.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(score.size(), score.size());
  score(kSlow) = 0.5 * (modes.squaredNorm() - left.trace());
  information(kSlow, kSlow) = 0.5 * left.squaredNorm();
  Eigen::Index k = kIntervals;
  for (const LinearizedResidual& a : residuals) {
    if (a.kind != ResidualKind::kImu) continue;
    const double w2 = a.weight * a.weight;
    const Eigen::MatrixXd JP = timesCovariance(a, P).bottomRows<6>();
    score(k) = 0.5 * w2 * (a.r.tail<6>().squaredNorm() - 6.0);
    information(kSlow, k) = information(k, kSlow) =
        0.5 * w2 * JP.middleCols(column, n).squaredNorm();
    Eigen::Index l = kIntervals;
    for (const LinearizedResidual& b : residuals) {
      if (b.kind != ResidualKind::kImu) continue;
      Eigen::Matrix<double, 6, 6> R =
          -std::sqrt(a.weight * b.weight) * timesTransposed(JP, b).rightCols<6>();
      if (&a == &b) {
        score(k) -= 0.5 * w2 * R.trace();
        R.diagonal().array() += 1.0;
      }
      information(k, l++) = 0.5 * a.weight * b.weight * R.squaredNorm();
    }
    ++k;
  }
  return scoredSizes(now, score, information, slow);
}

}  // namespace etalon
