#pragma once

#include <Eigen/Core>
#include <optional>

#include "etalon/optimization/solver_summary.h"

namespace etalon {

/** The least value of a quadratic on a sphere, see minimizeOnSphere. */
struct SphereMinimum {
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double cost = 0.0;  ///< g^T A g - 2 b^T g
};

/**
 * The global minimum of g^T A g - 2 b^T g over |g| = radius.
 *
 * With the eigenvalues l_i of A and b in its eigenvectors, beta_i, (A + mu I) g = b with the one root
 * mu >= -l_min of the secular equation  sum_i (beta_i / (l_i + mu))^2 = radius^2  (every other
 * stationary point costs more; Gander, Golub and von Matt, Linear Algebra Appl. 114, 1989). In the
 * hard case, b orthogonal to the weakest eigenvector and no root there, mu = -l_min and the length
 * that is missing is laid along that eigenvector: one of the minima, which are mirrored or a circle.
 *
 * @param A 3x3, symmetric; its lower triangle is read
 * @return nothing if A or b is not finite, or the radius not positive
 */
std::optional<SphereMinimum> minimizeOnSphere(const Eigen::Matrix3d& A, const Eigen::Vector3d& b,
                                              double radius);

/** Unknowns (y, g) by those of y and the two of g that leave its norm as it is: n others, so
 * (n+3) x (n+2). */
Eigen::MatrixXd tangentUnknowns(Eigen::Index n, const Eigen::Vector3d& g);

/** Solution of a linear least-squares problem whose last three unknowns have a known norm. */
struct NormConstrainedSolution {
  /** Singular: the other unknowns are not determined, or on the tangent plane gravity's direction.
   * Costs are (x^T A x) / 2 - b^T x, the initial
   * one at the seed of gravity. */
  SolverSummary summary;
  Eigen::VectorXd x;    ///< (y, g)
  Eigen::Matrix3d A_g;  ///< what A says of g once y is eliminated (Schur complement)
};

/**
 * Minimises x^T A x - 2 b^T x with x = (y, g), g the last three unknowns, |g| = radius: y is
 * eliminated, the rest is minimizeOnSphere().
 *
 * @param A (n+3)x(n+3), symmetric, its first n rows and columns positive definite; n may be 0
 */
NormConstrainedSolution solveNormConstrained(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                             double radius);

/**
 * The same problem by steps in the tangent plane of the sphere from `g_seed` (Qin et al.,
 * VINS-Mono, TRO 2018, section V-B3: four iterations). Finds the minimum near the seed; for a seed
 * within some ten degrees that is the global one.
 */
NormConstrainedSolution refineOnTangentPlane(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                             double radius, const Eigen::Vector3d& g_seed,
                                             int iterations = 4);

}  // namespace etalon
