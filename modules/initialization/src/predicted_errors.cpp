#include "etalon/initialization/predicted_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/core/symmetric.h"

namespace etalon {

namespace {

/** In the order of Initialization::covariance, with the poses of keyframes 1 to `poses`. */
Eigen::MatrixXd claimedWithPoses(const VisualInertialBaResult& result, Eigen::Index poses) {
  constexpr Eigen::Index kState = 9, kOthers = 11, kPoseSize = 6;
  const Eigen::Index n = result.states.size();
  if (n == 0 || result.covariance.rows() != kState * n + 6) return {};
  const SE3& first = result.states.front().T_WB;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(kOthers + kPoseSize * poses, kState * n + 6);
  J.block<6, 6>(0, kState * n).setIdentity();
  J.block<2, 3>(6, 0) = first.R.topRows<2>();  // from the body to the world
  J.block<3, 3>(8, kState * (n - 1) + 6).setIdentity();
  for (Eigen::Index k = 1; k <= poses; ++k) {
    const Eigen::Index row = kOthers + kPoseSize * (k - 1);
    const SE3 T_B0Bk = first.inverse() * result.states[k].T_WB;
    J.block<3, 3>(row, 0) = -T_B0Bk.R.transpose();
    J.block<3, 3>(row, kState * k).setIdentity();
    J.block<3, 3>(row + 3, 0) = hat(T_B0Bk.t);
    J.block<3, 3>(row + 3, 3) = -first.R.transpose();
    J.block<3, 3>(row + 3, kState * k + 3) = first.R.transpose();
  }
  return J * result.covariance * J.transpose();
}

}  // namespace

Eigen::MatrixXd claimedCovariance(const VisualInertialBaResult& result) {
  return claimedWithPoses(result, 0);
}

Eigen::MatrixXd claimedJointCovariance(const VisualInertialBaResult& result) {
  return claimedWithPoses(result, static_cast<Eigen::Index>(result.states.size()) - 1);
}

PredictedError predictedError(const Eigen::MatrixXd& covariance, double confidence) {
  constexpr double kAlike = 0.8;  // of standard deviations
  PredictedError error;
  if (!covariance.allFinite()) {
    error.bound = std::numeric_limits<double>::infinity();
    error.worst = Eigen::VectorXd::Unit(covariance.rows(), 0);
    error.alike_in_all_directions = true;
    return error;
  }
  const SymmetricEigen axes = symmetricEigen(covariance);
  error.worst = axes.vectors.rightCols<1>();
  const double largest = std::max(0.0, axes.values.tail<1>()(0));
  error.alike_in_all_directions = axes.values(0) >= kAlike * kAlike * largest;
  const double trace = covariance.trace(), square = covariance.squaredNorm();
  if (square > 0.0)
    error.bound =
        std::sqrt(square / trace * chiSquareQuantile(trace * trace / square, 1.0 - confidence));
  return error;
}

double largestSigma(const Eigen::MatrixXd& covariance) {
  return std::sqrt(std::max(0.0, symmetricEigenvalues(covariance).tail<1>()(0)));
}

}  // namespace etalon
