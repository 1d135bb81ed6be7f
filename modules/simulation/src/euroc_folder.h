#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * Writes a recording in EuRoC's (ASL) layout. Numbers are printed with the fewest digits that read
 * back as the same double. Whatever cannot be written throws DataError naming the file.
 */
class EurocFolder {
 public:
  /**
   * Makes the folders of cam0, cam1, imu0 and state_groundtruth_estimate0 in `path`/mav0. If `path`
   * exists and is not empty: ConfigError, unless `overwrite`, which removes those four folders and
   * nothing else.
   */
  EurocFolder(const std::string& path, bool overwrite);

  /** All sensor.yaml files; `comment` goes into each. */
  void writeCalibration(const StereoInertialCalibration& calibration,
                        const std::string& comment) const;
  void writeImu(const std::vector<ImuSample>& samples) const;
  /** 17 columns. */
  void writeGroundTruth(const std::vector<GroundTruthState>& states) const;
  /** The files as they are, byte for byte. */
  void copyImu(const std::string& file) const;
  void copyGroundTruth(const std::string& file) const;
  /** The data.csv of both cameras. */
  void writeImageLists(const std::vector<TimeNs>& stamps) const;
  /** One PNG. May be called from several threads, for different images. */
  void writeImage(size_t camera, TimeNs t, const cv::Mat& image) const;

 private:
  std::string root_;  // .../mav0
};

}  // namespace etalon
