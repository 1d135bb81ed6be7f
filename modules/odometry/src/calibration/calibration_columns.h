#pragma once

// The calibration as unknowns of the window: what may be wrong with it, and what that does to a
// pixel. Private to the module.

#include <array>

#include "etalon/core/calibration.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon::fixed_lag {

/** Where each deviation from the given calibration stands. */
enum CalibrationColumn : Eigen::Index {
  /** Seconds by which an image is later, in the IMU's time, than its stamp. */
  kTimeOffset = 0,
  kCameraRotation = 1,   ///< R_BC0 = given Exp(d), rad, about the axes of the left camera
  kCameraPosition = 4,   ///< of the left camera in the body, m, along the axes of the body
  kStereoRotation = 7,   ///< R_C0C1 = given Exp(d), rad, about the axes of the right camera
  kBaseline = 10,        ///< length of the baseline, relative
  kStereoShift = 11,     ///< of the right camera across the baseline, m, two directions
  kFocal = 13,           ///< focal lengths of the left and the right camera, relative
  kPrincipalPoint = 15,  ///< of the left camera (u, v), then of the right one, px
  /** By how much k1, k2 and k3 push a pixel away from the axis, px, at a sixth, a third and half of the
   * image's width from it; of the left camera, then of the right one. The coefficients themselves are
   * hardly told from each other. Nothing is known of a camera that has none. */
  kRadialDistortion = 19,
  kCalibrationSize = 25
};

constexpr int kRadialShifts = 3;  ///< of a camera
using RadialShift = Eigen::Matrix<double, kRadialShifts, 1>;

using CalibrationVector = Eigen::Matrix<double, kCalibrationSize, 1>;
using CalibrationJacobian = Eigen::Matrix<double, 2, kCalibrationSize>;

/** Standard deviations of a calibration that was done with care: what is believed before any
 * measurement. */
CalibrationVector calibrationPriorSigma();

/** The calibration with the deviations; the time offset is not in it. A pinhole of k1 and k2 whose
 * radial distortion deviates has k3, too. */
StereoInertialCalibration corrected(const StereoInertialCalibration& given,
                                    const CalibrationVector& deviation);

/** A measurement of a pixel by `before` as it is by `after`. */
ReprojectionMeasurement remeasured(const CameraModel& before, const CameraModel& after,
                                   const ReprojectionMeasurement& measurement);

/** Derivatives of reprojectionResidual() by the deviations. */
class CalibrationDerivatives {
 public:
  CalibrationDerivatives() = default;
  CalibrationDerivatives(const StereoInertialCalibration& given,
                         const CalibrationVector& deviation);

  /**
   * @param T_HT pose of the observing body in the landmark's frame, H
   * @return 2 x 25, whitened; zero by the time offset, which moves T_HT alone, and where the
   *         landmark is behind the camera
   */
  CalibrationJacobian operator()(size_t camera, const ReprojectionMeasurement& measurement,
                                 const SE3& T_HT, const InverseDepthLandmark& landmark) const;

 private:
  StereoInertialCalibration calibration_;  ///< corrected
  SE3 T_C0C1_;
  CalibrationVector deviation_ = CalibrationVector::Zero();
  Eigen::Matrix3d camera_right_, stereo_right_;  ///< right Jacobians of the two rotations
  Eigen::Matrix3d baseline_;                     ///< d(position of C1 in C0)/d(baseline, shift)
  /** Each camera after a step of each shift by radial distortion. */
  std::array<std::array<CameraModel, kRadialShifts>, 2> shifted_;
};

}  // namespace etalon::fixed_lag
