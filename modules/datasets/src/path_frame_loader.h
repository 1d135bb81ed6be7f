#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/recorded_source.h"
#include "image_file.h"

namespace etalon {

/** Reads one pair from image files. */
inline FrameLoader::Result loadPair(TimeNs t, const std::string& left, const std::string& right,
                                    const StereoInertialCalibration& calibration, bool decode) {
  FrameLoader::Result result;
  result.frame.t = t;
  result.frame.left_path = left;
  result.frame.right_path = right;
  if (!decode) return result;
  const auto load = [&](const std::string& path, const CameraModel& camera) {
    if (!result.problem.empty()) return cv::Mat();
    cv::Mat image = readGrayImage(path, &result.problem);
    if (result.problem.empty()) result.problem = checkImage(image, camera);
    if (!result.problem.empty()) result.file = path;
    return image;
  };
  result.frame.left = load(left, calibration.cameras[0].model);
  result.frame.right = load(right, calibration.cameras[1].model);
  return result;
}

}  // namespace etalon
