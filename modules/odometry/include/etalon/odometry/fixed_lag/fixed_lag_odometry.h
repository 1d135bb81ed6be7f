#pragma once

#include <memory>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/map/map_options.h"
#include "etalon/map/view_matcher.h"
#include "etalon/odometry/odometry.h"

namespace etalon {

/** Section [fixed_lag]. */
struct FixedLagOptions {
  int recent_frames = 3;               ///< newest states with velocity and biases
  int keyframes = 7;                   ///< older states, poses alone
  int iterations = 3;                  ///< Gauss-Newton steps a frame, at most
  double sigma_px = kTrackSigmaPx;     ///< of a pixel at the start; not a key ([odometry] has it)
  double least_sigma_px = 0.1;         ///< it follows the residuals, but not below this
  double chi2_gate = 25.0;             ///< of an observation against its prediction
  double chi2_outlier = 16.0;          ///< of one after the optimisation, in sigma_px
  double chi2_bias_jump = 20.0;        ///< of a bias jump, in each of six frames
  double keyframe_survival = 0.7;      ///< share of a frame's tracks that are landmarks
  double keyframe_parallax_px = 12.0;  ///< median since the last keyframe, rotation apart
  double gravity_mps2 = 9.81;          ///< not a key
  ImuNoiseDensities imu_noise;         ///< densities to use; not a key
  CalibrationOptions calibration;      ///< keys of [odometry]

  void declare(ParameterSet& parameters);
};

/**
 * Tightly coupled stereo-inertial odometry over a sliding window: the newest frames with pose,
 * velocity and biases, older keyframes with their pose, landmarks as bearing and inverse distance
 * in the keyframe that saw them first. Everything older is a linear prior whose linearisation
 * points are kept (first estimates), so that nothing is learnt of position and yaw of the whole.
 *
 * A frame's state is predicted by the IMU; its observations are held against that prediction
 * before they are used. A frame without observations is dead reckoning: its covariance says so.
 */
class FixedLagOdometry : public Odometry {
 public:
  FixedLagOdometry(const StereoInertialCalibration& calibration, const FixedLagOptions& options);
  /** With a map: old keyframes stay, and landmarks are found in them again by `views`, which must
   * know the images of a frame before process() has it. */
  FixedLagOdometry(const StereoInertialCalibration& calibration, const FixedLagOptions& options,
                   const MapOptions& map, std::shared_ptr<ViewMatcher> views);
  ~FixedLagOdometry() override;

  OdometryOutput start(const OdometryStart& start, const TrackedFrame& frame) override;
  OdometryOutput process(const TrackedFrame& frame, const std::vector<ImuSample>& imu) override;
  bool moveWorld(const SE3& T_WW0) override;
  Trajectory keyframes() const override;
  Trajectory seenFrom() const override;
  std::map<LandmarkId, Eigen::Vector3d> landmarks() const override;
  std::vector<CalibrationFinding> calibrationFindings() const override;
  std::optional<StereoInertialCalibration> calibrationInUse() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon
