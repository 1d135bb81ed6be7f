#pragma once

// The patch that a track started from, and its alignment with later images.

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace etalon {

/** Where a patch lies in an image: its point d (px from the centre) at centre + A d. */
struct PatchPose {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
};

/**
 * A square patch of an image, aligned with another image by Gauss-Newton on an affine warp, inverse
 * compositional (Baker and Matthews, IJCV 2004): minimises over the pose, a gain g and an offset o
 *   sum over d of (image(centre + A d) - g T(d) - o)^2.
 * Gain and offset are eliminated: the steepest-descent images are made orthogonal to T and to the
 * constant. Images have 8-bit gray levels and at most 32767 columns, rows and bytes a row.
 */
class AnchorPatch {
 public:
  AnchorPatch() = default;
  /** Takes the patch around `centre`, bilinear. Invalid if it leaves the image or has too little
   * texture. */
  AnchorPatch(const cv::Mat& image, const Eigen::Vector2d& centre, int side);

  bool valid() const { return products_.rows() > 0; }

  /**
   * Moves `pose` to where the patch fits best.
   * @param epsilon_px the last step is shorter than this, or the one after it would be
   * @return the normalised correlation there, as it was before the last step; negative if it left
   * the image or did not converge, and `pose` is then meaningless
   */
  double align(const cv::Mat& image, PatchPose* pose, int max_iterations, double epsilon_px) const;

 private:
  /** The image under the patch; false if the patch leaves it. */
  bool sample(const cv::Mat& image, const PatchPose& pose, std::vector<float>* values) const;

  int radius_ = 0;
  float patch_squares_ = 0;  ///< squared norm of the patch less its mean
  /** What an image under the patch is multiplied by: the patch less its mean, and 6
   * steepest-descent images, pre-multiplied by the inverse Hessian. */
  Eigen::Matrix<float, Eigen::Dynamic, 7> products_;
};

}  // namespace etalon
