#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"

namespace etalon::plugins {

/**
 * The linear global translation constraint (Cai et al., A Pose-Only Solution to Visual
 * Reconstruction, 2021; He et al., CVPR 2023) of a stereo rig whose rotations are known.
 *
 * The views of a landmark are its observations in either camera of any keyframe: unit ray d_i in V,
 * camera centre c_i = p_k + R_VBk t_BC. Two base views a, b give the depth along d_a,
 *   z = n . (d_b x (c_b - c_a)) / |n|^2,   n = d_b x d_a,
 * and the landmark c_a + z d_a must lie along d_i: N_i^T (c_a + z d_a - c_i) = 0, with N_i the 3x2
 * null-space of d_i. The constraint is linear in the positions p_k; the known offsets between the
 * cameras give the scale. Rows are divided by the distance and by the standard deviation that the
 * three rays' noise gives them.
 *
 * The base views of largest angle are the most accurate, but wrong tracks make large angles, too.
 * So the first base is the stereo pair of median distance, and chooseWidestBases() looks for the
 * largest angle only among the views that agree with it.
 */
class TranslationConstraint {
 public:
  /**
   * @param R_VB rotations of the keyframes
   * @param sigma_px standard deviation of a pixel coordinate
   * @param min_parallax_rad landmarks whose base views make a smaller angle are left out
   */
  TranslationConstraint(const StereoInertialCalibration& calibration,
                        const std::vector<const TrackedFrame*>& keyframes,
                        const std::vector<Eigen::Matrix3d>& R_VB, double sigma_px,
                        double min_parallax_rad);

  /** Number of landmarks that have a base. */
  int landmarks() const;
  /** Number of views of such landmarks in the keyframe that has the fewest. */
  int fewestViews() const;
  /** Makes the two views of largest angle among those with small residuals each landmark's base. */
  void chooseWidestBases();

  /** Computes residuals, their standard deviations and weights at the positions `p` (m, in V). */
  void reweight(const std::vector<Eigen::Vector3d>& p, bool robust);

  /** Adds the lower triangle of H (3N x 3N) and the gradient of half the sum of weighted squared
   * residuals at `p`. */
  void addTo(const std::vector<Eigen::Vector3d>& p, Eigen::MatrixXd* H, Eigen::VectorXd* g) const;

  /** Robust standard deviation of the residuals: 0.4 to 0.8 where the pixels' noise is sigma_px,
   * because residuals that have one direction only are scaled like those with two. */
  double noise() const { return noise_; }

 private:
  struct View {
    int keyframe = 0;
    Eigen::Vector3d ray;     ///< d, in V
    Eigen::Vector3d offset;  ///< camera centre minus p_k, in V, m
    double sigma_rad = 0.0;  ///< of the ray, by its camera's focal length
    double weight = 0.0;     ///< of the squared residual in m^2
    double residual = 0.0;   ///< norm, in standard deviations; zero for base view a
  };
  struct Landmark {
    std::vector<View> views;
    size_t a = 0, b = 0;  ///< base views; equal: none
    double sine = 0.0;    ///< of the angle between their rays
    bool hasBase() const { return a != b; }
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();  ///< z = slope . (c_b - c_a)
  };
  /** Makes the two views the base if their angle is large enough. */
  void setBase(size_t a, size_t b, Landmark* landmark) const;
  void chooseStereoBase(Landmark* landmark) const;
  /** Landmark from its base views, at the positions p. */
  static double depth(const Landmark& landmark, const std::vector<Eigen::Vector3d>& p);

  std::vector<Landmark> landmarks_;
  int keyframe_count_ = 0;
  double min_parallax_rad_ = 0.0;
  double noise_ = 0.0;
};

}  // namespace etalon::plugins
