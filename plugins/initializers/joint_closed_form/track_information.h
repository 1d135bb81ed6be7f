#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/optimization/visual_window.h"

namespace etalon::plugins {

/** Landmarks from both cameras of single frames, in the body frame of each. */
struct StereoPoints {
  struct Point {
    int keyframe = 0;
    Eigen::Vector3d p_B;  ///< m
  };
  std::vector<std::vector<Point>> of_landmark;  ///< index as the window's landmarks
};

/** Frames whose two rays miss each other (squared residual above `max_chi2`) give no point. */
StereoPoints stereoPoints(const VisualWindow& window, double max_chi2);

/**
 * Positions from the stereo points under given rotations: step by step the median, per axis, of
 * what the landmarks common to two frames say of the step. Coarse, but not moved by outliers.
 */
std::vector<SE3> medianPositions(const StereoPoints& points,
                                 const std::vector<Eigen::Matrix3d>& R_VB);

/**
 * What the tracks say of the poses, landmarks eliminated: around the poses T_VB the cost is
 *   y^T S y - 2 s^T y,   y = [rotation (right perturbation), position] of nodes 1.., 6(N-1).
 *
 * Rows: S_m [I | -xy] p_C / depth with p_C = T_CB T_VB^-1 p_V: linear in landmark and position, and
 * in pixels' sigmas because of the division by the depth of the last estimate. Weights are Geman
 * and McClure's, (c^2 / (c^2 + r^2))^2, with c the larger of `scale` and a multiple of the median
 * of |r|: the first passes, far from the solution, let everything in.
 */
class TrackInformation {
 public:
  TrackInformation(const VisualWindow& window, double scale) : window_(window), scale_(scale) {}

  /** Landmarks as the medians of their stereo points. Those without any stay out for good. */
  void start(const StereoPoints& points, const std::vector<SE3>& T_VB);

  /** Moves the landmarks to where the rays meet, with robust weights; updates residuals. */
  void triangulate(const std::vector<SE3>& T_VB);
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

 private:
  void eliminate(int l, const std::vector<SE3>& T_VB);
  void moveLandmark(int l, const std::vector<SE3>& T_VB);
  void updateScale();
  double weight(double r2) const;

  const VisualWindow& window_;
  double scale_;
  double c2_ = 1e12;
  std::vector<Eigen::Vector3d> landmarks_;  ///< p_V, m
  std::vector<char> valid_;
  std::vector<double> r2_;  ///< squared residual of every measurement
  Eigen::MatrixXd S_;
  Eigen::VectorXd s_;
};

}  // namespace etalon::plugins
