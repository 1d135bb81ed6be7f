#pragma once

#include <Eigen/Core>
#include <array>

#include "error_sizes.h"
#include "flight_model.h"

namespace etalon::ground_truth {

/** The correlated errors: offset in a node, and the indices of their sizes. */
struct Kind {
  int offset, white, correlated, time;
};
constexpr std::array<Kind, 2> kKinds = {
    {{kPositionError, kPositionWhite, kPositionCorrelated, kPositionTime},
     {kRotationError, kRotationWhite, kRotationCorrelated, kRotationTime}}};

using ErrorAndRate = Eigen::Matrix<double, 3, 2>;

inline ErrorAndRate errorOf(const Node& node, int kind) {
  return node.errors.middleCols<2>(2 * kind);
}

/**
 * Transition and driving noise of the smooth correlated error, an axis: stationary, of correlation
 * (1 + a) exp(-a) with a = dt / time (Matern 3/2); state [error, time x its rate], of covariance
 * I when the error's is 1.
 */
struct Transition {
  Eigen::Matrix2d F, covariance;
};

/** @param a the step over the correlation time */
Transition transition(double a);

}  // namespace etalon::ground_truth
