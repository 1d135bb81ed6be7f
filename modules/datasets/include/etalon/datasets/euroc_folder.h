#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/output_file.h"
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
   * Makes the folders of cam0, cam1, imu0 and state_groundtruth_estimate0, which take their places
   * in `path`/mav0 at complete(). If `path` exists and is not empty: ConfigError, unless
   * `overwrite`, by which those four folders are replaced then and nothing else.
   * @param advice what to do about a folder that is not empty, as the end of a sentence
   */
  EurocFolder(const std::string& path, bool overwrite,
              const std::string& advice = "choose another or overwrite it with --force");

  /** All sensor.yaml files; `comment` goes into each. */
  void writeCalibration(const StereoInertialCalibration& calibration,
                        const std::string& comment) const;
  void writeImu(const std::vector<ImuSample>& samples) const;
  /** 17 columns, or 8 of a ground truth without velocities or biases. */
  void writeGroundTruth(const GroundTruth& truth) const;
  /** 17 columns. */
  void writeGroundTruth(const std::vector<StampedState>& states) const;
  /** The files as they are, byte for byte. */
  void copyImu(const std::string& file) const;
  void copyGroundTruth(const std::string& file) const;
  /** The data.csv of both cameras. */
  void writeImageLists(const std::vector<TimeNs>& stamps) const;
  /** One PNG. May be called from several threads, for different images. */
  void writeImage(size_t camera, TimeNs t, const cv::Mat& image) const;
  /** Puts everything in place. Without this call nothing of it is left. */
  void complete() { output_->putInPlace(); }

 private:
  std::string sensor(const std::string& name) const { return output_->path(name); }

  std::unique_ptr<OutputFiles> output_;
};

}  // namespace etalon
