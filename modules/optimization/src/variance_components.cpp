#include "etalon/optimization/variance_components.h"

#include <Eigen/Cholesky>

namespace etalon {

AccelErrorSizes scoredSizes(const AccelErrorSizes& now, const Eigen::VectorXd& score,
                            const Eigen::MatrixXd& information, const SlowAcceleration& slow) {
  constexpr double kLargestStep = 1.5, kLeastVariance = 1e-18;
  // An interval's white noise is in two groups: that of all intervals, and its own.
  const Eigen::Index intervals = now.jolts.size(), groups = 2 + intervals;
  Eigen::MatrixXd in_group = Eigen::MatrixXd::Zero(1 + intervals, groups);
  in_group(0, 0) = 1.0;
  in_group.col(1).tail(intervals).setOnes();
  in_group.bottomRightCorner(intervals, intervals).setIdentity();

  Eigen::VectorXd sizes(groups), spread(groups);
  sizes << now.slow, now.white, now.jolts;
  spread << slow.spread, slow.white_spread, Eigen::VectorXd::Constant(intervals, slow.jolt_spread);
  const Eigen::VectorXd prior = spread.cwiseAbs2().cwiseMax(kLeastVariance).cwiseInverse();
  Eigen::MatrixXd H = in_group.transpose() * information * in_group;
  H.diagonal() += prior;
  const Eigen::VectorXd gradient =
      in_group.transpose() * score - 2.0 * prior.cwiseProduct(sizes.array().log().matrix());
  const Eigen::VectorXd step =
      H.llt().solve(gradient).cwiseMax(-kLargestStep).cwiseMin(kLargestStep);
  sizes.array() *= (0.5 * step).array().exp();

  AccelErrorSizes next(intervals);
  next.slow = sizes(0);
  next.white = sizes(1);
  next.jolts = sizes.tail(intervals).cwiseMax(1.0);
  return next;
}

}  // namespace etalon
