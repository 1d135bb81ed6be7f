#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/initialization/steps/stereo_start.h"
#include "etalon/optimization/bundle/normal_equations.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/**
 * What the tracks say of the poses, landmarks eliminated: around the poses T_VB the cost is
 *   y^T S y - 2 s^T y,   y = [rotation (right perturbation), position] of nodes 1.., 6(N-1).
 *
 * One step of Gauss-Newton on the reprojection errors, whose derivatives are taken at the
 * prediction: with the measured direction in their place (rows that are linear in landmark and
 * position) the pixel's noise is in derivative and residual alike, and the estimate off by its
 * square. Weights are Geman and McClure's, (c^2 / (c^2 + r^2))^2, with c the larger of `scale` and
 * a multiple of the median of |r|: the first passes, far from the solution, let everything in.
 *
 * Residuals are in units of the window's pixel noise. Where that is an upper bound, what the
 * residuals show counts instead (the variance factor of an adjustment a posteriori: Koch, Parameter
 * Estimation and Hypothesis Testing in Linear Models, 3.2.5), `least_noise` times the bound at least.
 */
class TrackInformation {
 public:
  TrackInformation(const VisualWindow& window, double scale, double least_noise = 1.0);

  /** Landmarks as the medians of their stereo points. Those without any stay out for good. */
  void start(const StereoPoints& points, const std::vector<SE3>& T_VB);

  /** Moves the landmarks to where the rays meet, with robust weights; updates residuals.
   * @param most_moves of a landmark; fewer where it comes to rest */
  void triangulate(const std::vector<SE3>& T_VB, int most_moves = 1);
  void linearize(const std::vector<SE3>& T_VB);

  const Eigen::MatrixXd& S() const { return S_; }
  const Eigen::VectorXd& s() const { return s_; }
  const std::vector<Eigen::Vector3d>& landmarks() const { return landmarks_; }
  const std::vector<char>& valid() const { return valid_; }
  int validCount() const;
  /** Share of the valid landmarks' measurements within `max_chi2`. */
  double inlierShare(double max_chi2) const;
  /** Whether c has come down to about `scale`; outliers keep the median, and so c, above it. */
  bool nearFinalScale() const { return c2_ <= 4.0 * scale_ * scale_; }
  /** Standard deviation of the pixels as the median residual shows it, in those of the window, where
   * that is what c follows. */
  double noise() const { return 0.5 * std::sqrt(c2_); }

  /**
   * Of S, the share that is the tracks' Fisher information. A weight that falls with the residual
   * makes S larger than the score's derivative; S itself is scaled such that the score's variance
   * is its derivative, so that tracks and IMU meet at their worth.
   */
  double fisherShare() const { return fisher_share_; }

  /**
   * Fisher information (score) and second derivatives of the cost (curvature) by y, at the poses of
   * the last triangulate(): far landmarks make the first larger than the second. A landmark that
   * has not come to rest there has a curvature that means nothing.
   */
  NormalEquations information(const std::vector<SE3>& T_VB) const;

 private:
  /** Of a landmark, what a node's cameras say of its position in V. */
  struct View {
    int node = 0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };

  /** A measurement's residual where its landmark and the poses are. */
  struct Row {
    bool ahead = false;  ///< the camera can see the landmark
    double depth = 0.0;  ///< along the measurement's axis, m
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 3> A;  ///< d(r)/d(landmark)
  };

  /** Has rows_ at these poses. */
  void place(const std::vector<SE3>& T_VB);
  /** Has the rows of a landmark where it is. */
  void evaluate(size_t l);
  /** @return the squared step in standard deviations of the landmark */
  double moveLandmark(size_t l);
  /** How a step of its landmark changes a measurement's depth, by the depth. */
  double shareOfDepth(int measurement, const Eigen::Vector3d& step) const;
  void eliminate(size_t l, const std::vector<SE3>& T_VB, Eigen::Index column);
  void updateScale(size_t nodes);
  double weight(double r2) const;

  const VisualWindow& window_;
  double scale_, least_noise_;
  double score_scale_ = 1.0, fisher_share_ = 1.0;
  double c2_ = 1e12;
  std::vector<SE3> T_VB_;                   ///< poses of rows_; empty: none
  std::vector<SE3> T_CV_;                   ///< of every node's left and right camera
  std::vector<Row> rows_;                   ///< of every measurement of a valid landmark
  std::vector<Eigen::Vector3d> landmarks_;  ///< p_V, m
  std::vector<char> valid_;
  std::vector<char> at_infinity_;  ///< where no finite depth is better
  std::vector<double> r2_;         ///< squared residual of every measurement
  Eigen::MatrixXd S_;
  Eigen::VectorXd s_;
  /** What the elimination of all landmarks takes from S_ is this times its transpose, 3 columns a
   * landmark. */
  Eigen::MatrixXd by_landmark_;
  std::vector<View> views_;  ///< of one landmark; a member, so that its memory is kept
};

}  // namespace etalon
