#pragma once

// The states, landmarks and prior of a FixedLagOdometry. Private to the module.

#include <array>
#include <map>
#include <optional>
#include <vector>

#include "calibration/calibration_columns.h"
#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/optimization/marginalization/linear_rows.h"
#include "etalon/optimization/residuals/inertial_residual.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon::fixed_lag {

using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Vector15d = Eigen::Matrix<double, 15, 1>;

/** A point of the left image of a retained keyframe at which landmarks were found. */
struct FoundPoint {
  Eigen::Vector2d pixel;
  int times = 0;
};

/** The body at a frame. Unknowns: pose, and velocity and biases while it is `full`. */
struct WindowState {
  int serial = 0;  ///< of the frame
  TimeNs t = 0;
  NavState now;  ///< the estimate
  /** Derivatives by absolute poses, velocities and biases are taken here: at the estimate until
   * the prior touches the state, and from then on where that was (`fixed`). */
  NavState linearization;
  bool fixed = false;
  bool full = true;
  bool keyframe = false;
  bool is_view = false;                 ///< landmarks can be found in it again
  bool at_rest = false;                 ///< since the state before
  bool retained = false;                ///< an old keyframe, kept to be found again
  std::vector<FoundPoint> found_again;  ///< where landmarks were found in it, far from each other
  std::optional<TimeNs> recognition_tried;  ///< last frame in which it was not recognised
  Preintegration imu;  ///< from the state before; of the oldest full state it is part of the prior
  Matrix15d imu_sqrt_information = Matrix15d::Zero();
  Eigen::Index column = 0;  ///< of its first unknown
  /** Angular rate (rad/s) and velocity (m/s) in the axes of the body, while its image was taken. */
  Eigen::Matrix<double, 6, 1> twist_B = Eigen::Matrix<double, 6, 1>::Zero();
  /** From the body at `t` to the body when the image was taken: Window::time_offset later. */
  SE3 T_BI;

  Eigen::Index size() const { return full ? 15 : 6; }
  /** Pose of the body when its image was taken, T_WI. */
  SE3 seenFrom() const { return now.T_WB * T_BI; }
  /** The error of `now` about `linearization`. */
  Vector15d delta() const { return fixed ? now.minus(linearization) : Vector15d::Zero(); }
};

/** A landmark in one frame. */
struct LandmarkObservation {
  int serial = 0;  ///< of the state
  int state = 0;   ///< its index in the window
  bool has_right = false;
  std::array<ReprojectionMeasurement, 2> measurements;
  bool has_left = true;

  /** The cameras that see it: from first() to before end(). */
  size_t first() const { return has_left ? 0 : 1; }
  size_t end() const { return has_right ? 2 : 1; }
};

struct Landmark {
  LandmarkId id = 0;
  int host_serial = 0;
  int host = 0;                  ///< index of the state in whose body frame it lives
  InverseDepthLandmark in_host;  ///< origin and axes in that frame
  std::vector<LandmarkObservation> observations;  ///< in time order, the host's too
  int strikes = 0;                                ///< observations in a row that did not agree
  std::vector<int> sought;  ///< serials of retained states in which it was not found
  /** Of its parameters, given the poses; from the last linearisation. */
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  bool seenIn(int serial) const {
    return !observations.empty() && observations.back().serial == serial;
  }
};

/** The calibration as unknowns: the first columns of the window, which never leave it. They are held
 * where they are while the window is solved. */
struct WindowCalibration {
  bool unknown = false;  ///< whether there are columns
  StereoInertialCalibration given;
  CalibrationVector now = CalibrationVector::Zero();  ///< deviation that is in use
};

struct Window {
  std::array<SE3, 2> T_CB;
  WindowCalibration calibration;
  Eigen::Vector3d g_W = Eigen::Vector3d::Zero();
  std::vector<WindowState> states;  ///< in time order, the full ones last
  std::map<LandmarkId, Landmark> landmarks;
  /** In the states' deltas: |A delta + b|^2; its unknowns are the first columns of the window. */
  LinearRows prior;
  /** Variance of a pixel over that of sigma_px, as the residuals say it is. */
  double pixel_variance = 1.0;

  /** Columns before those of the states. */
  Eigen::Index calibrationColumns() const {
    return calibration.unknown ? static_cast<Eigen::Index>(kCalibrationSize) : 0;
  }
  Eigen::Index unknowns() const {
    return states.empty() ? 0 : states.back().column + states.back().size();
  }
  /** After states came or went: columns, and indices in landmarks and observations. Observations
   * and landmarks whose state is gone are dropped. */
  void reindex();
  size_t firstFull() const;
  size_t retainedCount() const;
};

/** A window of one state with its prior: its error has the covariance whose inverse is L^T L. */
Window windowAt(const StereoInertialCalibration& calibration, const Eigen::Vector3d& g_W,
                const NavState& state, TimeNs t, const Matrix15d& L);

/** Makes the calibration unknown, with its prior; of a window as windowAt() makes it. */
void addCalibrationColumns(const StereoInertialCalibration& given, Window* window);

/** Uses another deviation from the given calibration from now on: cameras, the instants of the
 * images, and the measurements that the window holds. */
void setCalibration(const CalibrationVector& deviation, Window* window);

/** Where the images of the full states were taken, with the velocities as they are now. */
void updateImageTimes(Window* window);

/** Appends the state at the end of the interval, where the IMU predicts it. */
void appendState(Preintegration preintegration, Window* window);

/** Odometry::moveWorld(). Landmarks live in the bodies of their hosts, and stay. */
void moveWorld(const SE3& T_WW0, Window* window);

/** Body of state `t` in the body of state `h`. */
inline SE3 relativePose(const SE3& T_WH, const SE3& T_WT) {
  return {T_WH.R.transpose() * T_WT.R, T_WH.R.transpose() * (T_WT.t - T_WH.t)};
}

/** Derivatives of the pose of the target in the host, [rotation by right perturbation, position in
 * the host], by the two absolute ones. */
struct RelativeJacobians {
  Eigen::Matrix<double, 6, 6> by_target, by_host;
};
RelativeJacobians relativeJacobians(const SE3& T_WH, const SE3& T_WT);
/** Covariance of the same, from the joint one of the errors of both poses, host first. */
Eigen::Matrix<double, 6, 6> relativeCovariance(const SE3& T_WH, const SE3& T_WT,
                                               const Eigen::Matrix<double, 12, 12>& joint);

}  // namespace etalon::fixed_lag
