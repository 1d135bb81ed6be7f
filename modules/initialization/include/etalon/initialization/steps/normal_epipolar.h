#pragma once

/*
 * Normal epipolar constraint between two views of one camera: the normals of the epipolar planes
 * are orthogonal to the direction of translation.
 *
 * Frames      Ci, Cj the camera at two instants; f_i, f_j unit bearings of one landmark.
 * Parameters  R = R_CiCj, 3 degrees of freedom, right perturbation R Exp(d).
 * Cost        M(R) = sum of w n n^T, n = f_i x (R f_j);  lambda(R) = min over t of
 *             t^T M t / t^T N t, the smallest eigenvalue of M relative to N (1x1). With N = I this
 *             is the published cost; with N the covariance of the normals summed over the matches,
 *             lambda is the sum of squared residuals in units of their mean variance, and no
 *             direction of t is preferred for being poorly measured.
 * O(1)        t . n = vec(E) . vec(f_i f_j^T) with E = -[t]x R: M and all its derivatives are
 *             contractions of the 9x9 sum of w vec(f_i f_j^T) vec(f_i f_j^T)^T, formed once.
 * Leaves out  that R is nearly free where there is no parallax (see rotationOnlyCost()).
 * Reference   Kneip and Lynen, Direct Optimization of Frame-to-Frame Rotation, ICCV 2013.
 */

#include <Eigen/Core>

namespace etalon {

/** The weighted sums over the matches of two views from which the cost follows for any rotation. */
class EpipolarMoments {
 public:
  /** Adds a match of unit bearings f_i, f_j with the given weight. */
  void add(const Eigen::Vector3d& f_i, const Eigen::Vector3d& f_j, double weight) {
    const Eigen::Matrix<double, 6, 1> u = monomials(f_i);
    sum_.noalias() += (weight * u) * monomials(f_j).transpose();
    weight_ += weight;
  }
  void clear() { *this = EpipolarMoments(); }

  double weight() const { return weight_; }  ///< sum of the weights

  /** M(R), 3x3. */
  Eigen::Matrix3d normals(const Eigen::Matrix3d& R) const;

  /**
   * Covariance of the normals over the variance of a bearing's components, summed like M: with
   * isotropic noise of the bearings, sum of w ((I - f_i f_i^T) + (I - R f_j f_j^T R^T)), to zeroth
   * order in the angle between f_i and R f_j. 3x3.
   */
  Eigen::Matrix3d normalCovariance(const Eigen::Matrix3d& R) const;

  /** Sum of w vec(f_i f_j^T) vec(f_i f_j^T)^T, vec by columns: element 3 b + a is f_i[a] f_j[b]. */
  Eigen::Matrix<double, 9, 9> products() const;

 private:
  /** xx, xy, xz, yy, yz, zz of f f^T. */
  static Eigen::Matrix<double, 6, 1> monomials(const Eigen::Vector3d& f) {
    Eigen::Matrix<double, 6, 1> u;
    u << f.x() * f.x(), f.x() * f.y(), f.x() * f.z(), f.y() * f.y(), f.y() * f.z(), f.z() * f.z();
    return u;
  }
  Eigen::Matrix<double, 6, 6> sum_ = Eigen::Matrix<double, 6, 6>::Zero();
  double weight_ = 0.0;
};

/** A cost of one pair of views at one rotation, with derivatives by the perturbation of R. */
struct EpipolarCost {
  double value = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< d(value)/d(rotation), 1/rad
  /** Gauss-Newton's approximation of the Hessian, t eliminated; positive semi-definite; exact where
   * the residuals vanish. 1/rad^2 */
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of translation, in Ci, unit, sign free
  /** 1 - lambda_0 / lambda_1: 0 where noise alone decides on the direction, 1 where parallax does.
   */
  double certainty = 1.0;
};

/**
 * The smallest eigenvalue of M(R) relative to N.
 * @param N symmetric positive definite; identity for the published cost
 */
EpipolarCost smallestEigenvalueCost(const EpipolarMoments& moments, const Eigen::Matrix3d& R,
                                    const Eigen::Matrix3d& N);

/**
 * The trace of N^-1 M(R): what remains of the normals where there was no translation at all; the
 * landmarks at infinity, the camera at rest. Its expectation is three, or two where the bearings
 * span a narrow cone (a normal has two components), for every unit of smallestEigenvalueCost()'s
 * one. `direction` and `certainty` are left as they are.
 */
EpipolarCost rotationOnlyCost(const EpipolarMoments& moments, const Eigen::Matrix3d& R,
                              const Eigen::Matrix3d& N);

}  // namespace etalon
