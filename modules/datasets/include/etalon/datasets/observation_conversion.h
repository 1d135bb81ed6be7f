#pragma once

#include <mrpt/obs/CObservationIMU.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CObservationStereoImages.h>

#include <optional>
#include <string>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Sensor labels of the streams in a log that this project writes. */
constexpr const char* kStereoLabel = "stereo";
constexpr const char* kImuLabel = "imu0";
constexpr const char* kGroundTruthLabel = "ground_truth";

mrpt::poses::CPose3D toMrptPose(const SE3& T);
SE3 fromMrptPose(const mrpt::poses::CPose3D& pose);

/**
 * A frame as MRPT's observation: calibration of both cameras, T_BC0 as the camera's pose, T_C0C1 as
 * the right camera's pose on the left one. Images with a path are referenced by it if `external`,
 * else the pixels are shared (cloned where they are not contiguous, which MRPT cannot store).
 */
mrpt::obs::CObservationStereoImages toObservation(const StereoFrame& frame,
                                                  const StereoInertialCalibration& calibration,
                                                  bool external = false);

/** A sample as MRPT's observation; the sensor's pose is the identity (the body frame is the IMU).
 */
mrpt::obs::CObservationIMU toObservation(const ImuSample& sample);

/**
 * T_WB as MRPT's observation.
 * @param covariance of the pose's error, [rotation, position]: T_WB = (R Exp(d), t + e), rad and m;
 *        becomes MRPT's, of x, y, z, yaw, pitch and roll: that of a kilometre and any angle where it
 *        is not finite, because zero, which it is without, says that the pose is exact
 */
mrpt::obs::CObservationRobotPose toObservation(
    const StampedPose& pose, const std::string& label,
    const Eigen::Matrix<double, 6, 6>& covariance = Eigen::Matrix<double, 6, 6>::Zero());

/**
 * An image of an observation as a gray one of 8 bits, shared with it where it is one already.
 * @param base_folder of an external image with a relative path; empty: MRPT's own
 *        (CImage::setImagesPathBase(), else the working folder)
 * @param path receives that of an external image
 * @param name stands for the observation in messages
 * @throws DataError if it is empty, has other than 8 bits, or cannot be read
 */
cv::Mat toGrayImage(const mrpt::img::CImage& image, const std::string& base_folder,
                    std::string* path, const std::string& name);

/**
 * The images of an observation as gray ones (shared with the observation where they are 8-bit gray
 * already). External images are read, a relative path as toGrayImage() takes it.
 * @throws DataError if there is no right image, or if an image cannot be read
 */
StereoFrame toStereoFrame(const mrpt::obs::CObservationStereoImages& observation,
                          const std::string& base_folder = "");

/** Nothing unless all three rates and all three accelerations (in the sensor's frame) are present.
 */
std::optional<ImuSample> toImuSample(const mrpt::obs::CObservationIMU& observation);

/**
 * Calibration from the observation alone. `T_RB` is the IMU's pose on the robot
 * (CObservationIMU::sensorPose). Rates and the IMU's noise keep their defaults.
 * @param name stands for the observation in messages
 * @throws DataError that says what is missing or not supported
 */
StereoInertialCalibration calibrationOf(const mrpt::obs::CObservationStereoImages& observation,
                                        const SE3& T_RB, const std::string& name);

}  // namespace etalon
