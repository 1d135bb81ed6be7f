#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "etalon/datasets/recording_reader.h"

namespace etalon {

/** Decodes the bytes of an image file as 8-bit gray. Empty if that fails, and then `problem` says
 * why. */
cv::Mat decodeGrayImage(const std::vector<unsigned char>& bytes, std::string* problem);

/** Reads an image file as 8-bit gray. Empty if that fails, and then `problem` says why. */
cv::Mat readGrayImage(const std::string& path, std::string* problem);

/**
 * What is wrong with the image file of that camera, from its header and its end, without decoding
 * it; empty if nothing. The size is checked in PNG files only.
 */
std::string checkImageFile(const std::string& path, const CameraModel& camera);

/** What is wrong with an image of that camera; empty if nothing. */
std::string checkImage(const cv::Mat& image, const CameraModel& camera);

/** Reads one pair from image files; the pixels only if `decode`. */
LoadedFrame loadPair(TimeNs t, const std::string& left, const std::string& right,
                     const StereoInertialCalibration& calibration, bool decode);

}  // namespace etalon
