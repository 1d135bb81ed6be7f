#pragma once

#include <array>
#include <string>
#include <vector>

#include "etalon/core/camera_model.h"
#include "etalon/core/se3.h"

namespace etalon {

/** The two cameras of Kalibr's camchain, as kalibr_calibrate_imu_camera writes it. */
struct KalibrCamchain {
  std::array<CameraModel, 2> models;
  std::array<SE3, 2> T_CI;                 ///< IMU to camera
  std::array<double, 2> timeshift_s = {};  ///< IMU clock = camera clock + timeshift; 0 if not given
  std::array<std::string, 2> topics;       ///< `rostopic`; empty if it has none
  std::vector<std::string> warnings;
};

/**
 * Reads cam0 and cam1: camera_model, distortion_model, distortion_coeffs, intrinsics, resolution,
 * T_cam_imu (of cam1 by T_cn_cnm1 if it has none), timeshift_cam_imu and rostopic where there are such.
 * @throws DataError naming file, line, key and what was expected
 */
KalibrCamchain readKalibrCamchain(const std::string& path);

/**
 * By how much image stamps are to be moved to the IMU's clock, s: cam0's time shift, for both, so
 * that pairs stay pairs. Sentences on it are added to `warnings`.
 */
double imageTimeShift(const KalibrCamchain& chain, const std::string& path,
                      std::vector<std::string>* warnings);

}  // namespace etalon
