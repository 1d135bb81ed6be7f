#include "etalon/initialization/predicted_errors.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/statistics.h"

namespace etalon {

Eigen::MatrixXd claimedCovariance(const VisualInertialBaResult& result) {
  const Eigen::Index n = result.states.size();
  if (n == 0 || result.covariance.rows() != 9 * n + 6) return {};
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(11, 9 * n + 6);
  J.block<6, 6>(0, 9 * n).setIdentity();
  J.block<2, 3>(6, 0) = result.states.front().T_WB.R.topRows<2>();  // from the body to the world
  J.block<3, 3>(8, 9 * (n - 1) + 6).setIdentity();
  return J * result.covariance * J.transpose();
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
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(covariance);
  error.worst = axes.eigenvectors().rightCols<1>();
  const double largest = std::max(0.0, axes.eigenvalues().tail<1>()(0));
  error.alike_in_all_directions = axes.eigenvalues()(0) >= kAlike * kAlike * largest;
  const double trace = covariance.trace(), square = covariance.squaredNorm();
  if (square > 0.0)
    error.bound =
        std::sqrt(square / trace * chiSquareQuantile(trace * trace / square, 1.0 - confidence));
  return error;
}

double largestSigma(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues().tail<1>()(0)));
}

}  // namespace etalon
