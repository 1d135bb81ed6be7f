#pragma once

#include <map>
#include <vector>

#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** A landmark of a bundle adjustment. */
struct BundleLandmark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m; at kFarthestLandmark what is farther
  bool known = false;                                  ///< has a position
  bool valid = false;                                  ///< and at least two inliers
};

/**
 * The visual part of a bundle adjustment: a window's measurements, each an inlier or not, and its
 * landmarks. A solver takes one and gives it back, solved. Poses stand beside it, because each
 * solver has its own idea of them; landmarks are in the frame of the poses.
 */
struct BundleProblem {
  BundleProblem() = default;
  /** Landmarks of the window that `known` holds stand there; the others have no position. */
  explicit BundleProblem(VisualWindow visual_window,
                         const std::map<LandmarkId, Eigen::Vector3d>& known = {});

  VisualWindow window;
  std::vector<BundleLandmark> landmarks;  ///< in the window's order

  /** Triangulates, from the poses T_WB, the landmarks that have no position yet. */
  void triangulateMissing(const std::vector<SE3>& T_WB);

  /**
   * Chi-square relabelling: a measurement of a known landmark is an inlier if its squared residual
   * is below `chi2_threshold`; landmarks left with fewer than two inliers lose them and are not
   * valid. Returns the sum of the inliers' squared residuals.
   */
  double relabel(const std::vector<SE3>& T_WB, double chi2_threshold);

  int inlierCount() const;

  /** Standard deviation of the pixels over the one believed, by the median of the inliers' squared
   * residuals; landmarks take three of their coordinates. */
  double medianNoise(const std::vector<SE3>& T_WB) const;
  /** The same by the mean of those that are within four times the median: heavier tails than a
   * Gaussian's count. */
  double trimmedNoise(const std::vector<SE3>& T_WB) const;

  /** Positions of the valid landmarks. */
  std::map<LandmarkId, Eigen::Vector3d> validLandmarks() const;

 private:
  /** Of the inliers, each times what its landmark's fit takes out. */
  std::vector<double> squaredResiduals(const std::vector<SE3>& T_WB) const;
};

}  // namespace etalon
