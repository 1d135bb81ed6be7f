#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/nav_state.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"
#include "etalon/odometry/fixed_lag/online_calibration.h"

namespace etalon {

/** Where an odometry begins. */
struct OdometryStart {
  NavState state;  ///< at the stamp of the first frame, in a W whose z is up
  /** Of the state's error, 15 x 15 in the order of state_index, positive definite. Position and yaw
   * are free: give them a small variance. */
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Identity();
  /** By which the images are later, in the IMU's time, than their stamps, as far as is known before;
   * of no effect with CalibrationOptions::time_offset off. */
  double time_offset_s = 0.0;
  /** Places of landmarks, p_W, m, as the initialization knows them. An odometry may find its own. */
  std::map<LandmarkId, Eigen::Vector3d> landmarks;
};

/** A landmark that was found in an old keyframe. */
struct RecalledObservation {
  TimeNs keyframe = 0;      ///< in the odometry's time
  Observation observation;  ///< where that shows it
};

/** An old keyframe was recognised after a while without images. */
struct Recognition {
  TimeNs keyframe = 0;  ///< in the odometry's time
  TimeNs after = 0;     ///< last frame that images located before that while, in the same time
  SE3 T_WW0;  ///< all poses since then became T_WW0 T_WB, and were optimised from there on
};

/** What an odometry says after a frame. */
struct OdometryOutput {
  TimeNs t = 0;
  NavState state;
  /** Velocity, biases and covariance are estimated. False: the pose alone; the biases are the
   * start's and the velocity that from image to image. */
  bool inertial = true;
  /** Of the state's error, 15 x 15 in the order of state_index; of position and yaw relative to the
   * start. Zero unless `inertial`. */
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Zero();

  /** The state by the IMU, before the images of the frame were used; nothing: not told. */
  std::optional<NavState> predicted;

  bool keyframe = false;  ///< the frame became a keyframe
  /** The frame before has become one now, because this frame's images locate nothing. */
  bool previous_keyframe = false;
  int observations = 0;      ///< landmarks that the front end saw
  int used = 0;              ///< of these, landmarks that the estimate rests on
  int gated = 0;             ///< of these, far from where the state predicted them, and left out
  double unlocated_s = 0.0;  ///< since the last frame that images located; 0: this one is
  bool imu_missing = false;  ///< no IMU, or a gap in it, since the frame before
  double bridged_s = 0.0;    ///< of unlocated_s, without IMU
  std::vector<RecalledObservation> recalled;  ///< landmarks of the frame in old keyframes
  std::optional<Recognition> recognition;
  std::vector<std::string> remarks;  ///< what it has changed: calibration, biases
};

/** A state for every frame, from tracks and IMU; one thread, bit-identical from run to run. */
class Odometry {
 public:
  virtual ~Odometry() = default;

  /** Forgets everything and begins at `frame`. */
  virtual OdometryOutput start(const OdometryStart& start, const TrackedFrame& frame) = 0;

  /**
   * The next frame, later than the last one; it may have no observations.
   * @param imu what ImuBuffer::between() gives from the last frame to this one; empty where the
   *        IMU does not cover it
   */
  virtual OdometryOutput process(const TrackedFrame& frame, const std::vector<ImuSample>& imu) = 0;

  /**
   * The world turns about its z axis and moves: T_WB becomes T_WW0 T_WB in all that it knows. No
   * error of one pose relative to another changes.
   * @return false if it cannot; nothing has happened then
   */
  virtual bool moveWorld(const SE3& /*T_WW0*/) { return false; }

  /** T_WB of the keyframes that it still optimises, as it knows them now, by their frames' time. */
  virtual Trajectory keyframes() const = 0;

  /** The same when their images were taken, which a time offset has between stamp and image. */
  virtual Trajectory seenFrom() const { return keyframes(); }
  /** Places of the landmarks in use, p_W, m. */
  virtual std::map<LandmarkId, Eigen::Vector3d> landmarks() const = 0;
  /** What the flight so far says of the calibration; empty where that is not looked at. */
  virtual std::vector<CalibrationFinding> calibrationFindings() const { return {}; }
  /** The cameras as it uses them; nothing: as they were given. */
  virtual std::optional<StereoInertialCalibration> calibrationInUse() const { return {}; }

 protected:
  Odometry() = default;
  Odometry(const Odometry&) = default;
  Odometry& operator=(const Odometry&) = default;
};

}  // namespace etalon
