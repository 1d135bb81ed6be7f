#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon {

/** One landmark in one camera of one keyframe; indices into the window. */
struct VisualMeasurement {
  int keyframe = 0;
  int landmark = 0;
  int camera = 0;
  ReprojectionMeasurement measurement;
  bool inlier = false;  ///< BundleProblem::relabel() says which
};

/** The visual measurements of a window of keyframes, landmark by landmark. */
struct VisualWindow {
  std::array<SE3, 2> T_CB;
  int keyframe_count = 0;
  std::vector<LandmarkId> landmark_ids;         ///< increasing
  std::vector<VisualMeasurement> measurements;  ///< sorted by landmark, keyframe, camera
  /** measurements of landmark l: [first[l], first[l + 1]) */
  std::vector<int> first;

  int landmarkCount() const { return static_cast<int>(landmark_ids.size()); }
  bool contains(LandmarkId id) const {
    return std::binary_search(landmark_ids.begin(), landmark_ids.end(), id);
  }

  /** Those of a landmark, for a range-based loop. */
  template <typename Iterator>
  struct Range {
    Iterator first, last;
    Iterator begin() const { return first; }
    Iterator end() const { return last; }
  };
  using Measurements = std::vector<VisualMeasurement>;
  Range<Measurements::const_iterator> measurementsOf(size_t l) const {
    return {measurements.begin() + first[l], measurements.begin() + first[l + 1]};
  }
  Range<Measurements::iterator> measurementsOf(size_t l) {
    return {measurements.begin() + first[l], measurements.begin() + first[l + 1]};
  }

  /**
   * reprojectionResidual() of a measurement of this window.
   * @param T_WB poses of the keyframes
   * @param landmark p_W or an InverseDepthLandmark
   */
  template <typename Landmark>
  bool residual(const VisualMeasurement& m, const std::vector<SE3>& T_WB, const Landmark& landmark,
                Eigen::Vector2d* r, Eigen::Matrix<double, 2, 6>* J_pose = nullptr,
                Eigen::Matrix<double, 2, 3>* J_landmark = nullptr) const {
    return reprojectionResidual(T_CB[m.camera], m.measurement, T_WB[m.keyframe], landmark, r,
                                J_pose, J_landmark);
  }
};

/** chi-square thresholds at 95 % for 2 degrees of freedom: one camera's pixel. */
constexpr double kChi2Pixel = 5.991;
/** A pixel's squared residual of more than so many medians, one of 6e4 Gaussian ones, tells nothing
 * of the noise. */
constexpr double kOutlyingSquare = 16.0;

/** A landmark that a keyframe shows, apart from those of its tracks. */
struct MoreObservation {
  int keyframe = 0;
  const Observation* observation = nullptr;
  double sigma_px = 1.0;
};

/**
 * Collects what `keyframes` see, and `more`. A landmark is kept if two keyframes see it, or one does
 * with both cameras.
 */
VisualWindow buildVisualWindow(const StereoInertialCalibration& calibration,
                               const std::vector<const TrackedFrame*>& keyframes, double sigma_px,
                               const std::vector<MoreObservation>& more = {});

/**
 * Largest standard deviation of an inverse depth, 1/m, with which a landmark is triangulated. It
 * follows from the cameras' places and not from what they measured, so that noise cannot select the
 * near ones: at 0.5 px a stereo pair always is enough, and so are two views three centimetres
 * apart.
 */
constexpr double kMaxSigmaInverseDepth = 0.05;

/**
 * Triangulates landmark `l` of `window` from the poses T_WB by Gauss-Newton in inverse depth, which
 * is never negative: rays that meet behind the cameras give a point at kFarthestLandmark.
 * @return nothing if the cameras' places do not determine the depth, or if it is behind one of them
 */
std::optional<Eigen::Vector3d> triangulate(const VisualWindow& window, int l,
                                           const std::vector<SE3>& T_WB);

}  // namespace etalon
