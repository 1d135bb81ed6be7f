#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/nav_state.h"
#include "etalon/core/refusal.h"
#include "etalon/core/tracked_frame.h"

namespace etalon {

struct StageTiming {
  std::string stage;
  double milliseconds = 0.0;
};

/**
 * What an initializer found. W is gravity-aligned: g_W = (0, 0, -gravity). Position and yaw of W
 * are free (by convention the first keyframe is at the origin).
 */
struct Initialization {
  std::vector<StampedState> states;  ///< one a keyframe
  ImuBias bias;                      ///< of the whole window; Initializer copies it to the states
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_W, m; may be empty
  /**
   * Covariance of the errors (of those with a mean the mean square), estimate less truth, in this
   * order, 11 x 11 or, with the poses, 11 + 6(N-1) square for N keyframes; empty if there is none:
   *   0..2   b_g, rad/s, in B
   *   3..5   b_a, m/s^2, in B
   *   6..7   tilt of the world, rad, about the x and y axes of W:
   *          R_WB0 = Exp((tilt_x, tilt_y, 0)) R_WB0_true with B0 the body at the first keyframe
   *   8..10  v_WB of the last keyframe, m/s, in W
   *   11..   poses of keyframes 1.. relative to the first, T_B0Bk, six each: rotation, rad (right
   *          perturbation), and position, m, in B0 (relativePoseErrors())
   * The yaw of W is free, so the true world is turned about its z until the first keyframe's
   * attitudes differ by a horizontal rotation alone; the velocities are compared in that world
   * (estimationError()).
   */
  Eigen::MatrixXd covariance;
  std::optional<SE3> T_BC;           ///< left camera to body, by methods that estimate it
  std::vector<StageTiming> timings;  ///< steady clock, the plugin's own work
};

/** The left camera in the body as an initializer found it, and how far that is from where the
 * calibration has it. */
struct FoundExtrinsics {
  SE3 T_BC;
  double rotation_deg = 0.0, translation_m = 0.0;
};

/** What an initializer found, or why it found nothing. */
using InitializationResult = Expected<Initialization>;

}  // namespace etalon
