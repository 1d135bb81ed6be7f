#pragma once

// Gauss-Newton's equations of the pixels. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "bundle/landmark_views.h"
#include "bundle/window_landmarks.h"

namespace etalon {

/** Huber's loss of pixels: its width in sigmas, and sigma over that of the window. */
struct PixelLoss {
  double width, sigma;
};

/**
 * The normal equations of a window's inliers by the poses, landmarks eliminated:
 *   H d = -g,   d = [rotation (right perturbation), position (in W)] of every keyframe, 6N.
 * A landmark behind a camera counts as a gross outlier that nothing moves.
 */
class VisualEquations {
 public:
  /** @param window outlives this; its inliers are read anew by every call */
  explicit VisualEquations(const VisualWindow& window) : window_(window) {}

  /**
   * Linearises. Landmarks at infinity that the residuals want farther are held there.
   * @param T_WB as the cameras see the body
   * @param damping of the landmarks' own blocks, relative to their diagonal
   * @return half the sum of the squares, with the loss
   */
  double linearize(const std::vector<SE3>& T_WB, const PixelLoss& loss, double damping,
                   WindowLandmarks* landmarks);
  const Eigen::MatrixXd& H() const { return H_; }
  const Eigen::VectorXd& g() const { return g_; }
  /** Twice the decrease that the landmarks promise where the poses stay. */
  double promised() const { return promised_; }

  /** Moves the landmarks to where they are best, to first order, when the poses move by d. An inverse
   * depth that the views do not tell stays: its product with a baseline that is noise would not come
   * to rest. */
  void moveLandmarks(const Eigen::VectorXd& d, WindowLandmarks* landmarks) const;

 private:
  /** A keyframe's pose with a landmark: the mixed block times the landmark's root. */
  struct Mixed {
    int keyframe;
    Eigen::Matrix<double, 6, 3> with_root;
  };
  /** A landmark's own block and gradient. */
  struct Eliminated {
    size_t landmark, first, last;  ///< of mixed_
    Eigen::Matrix3d root;          ///< root root^T is the inverse of the block
    Eigen::Vector3d root_g;        ///< root^T times the gradient
    bool keeps_rho;                ///< rho is too little known to follow (kMaxSigmaInverseDepth)
  };

  /** Adds what views_ say, and takes away what the landmark can explain: the lower triangle. */
  void eliminate(size_t l, double rho, double damping);

  const VisualWindow& window_;
  std::vector<Eigen::Matrix3d> R_BW_;
  LandmarkViews views_;  ///< of one landmark; a member, so that its memory is kept
  std::vector<Mixed> mixed_;
  std::vector<Eliminated> eliminated_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
  double promised_ = 0.0;
};

}  // namespace etalon
