#pragma once

// Whitened residuals of a state, linearised, and what they say of it. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon {

/** What the rows of a residual are, for the covariance and the noise check. */
enum class ResidualKind {
  kImu,    ///< three rows of gyro noise, then six of the accelerometer given those
  kPrior,  ///< what is believed or fixed: no sensor's noise
};

/** A whitened residual and its derivatives by the state, at the state's values. */
struct LinearizedResidual {
  struct Part {
    Eigen::Index column;  ///< in the normal equations
    Eigen::MatrixXd J;    ///< by the tangent
  };
  ResidualKind kind = ResidualKind::kPrior;
  Eigen::VectorXd r;
  std::vector<Part> parts;
  double weight = 1.0;  ///< Huber's in the normal equations
};

/** J P, all columns. */
Eigen::MatrixXd timesCovariance(const LinearizedResidual& a, const Eigen::MatrixXd& P);

/** J P J_b^T of `JP`. */
Eigen::MatrixXd timesTransposed(const Eigen::MatrixXd& JP, const LinearizedResidual& b);

/** Adds what the residuals say of the state. */
void addInformation(const std::vector<LinearizedResidual>& residuals, NormalEquations* equations);

}  // namespace etalon
