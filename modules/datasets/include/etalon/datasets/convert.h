#pragma once

#include <functional>
#include <string>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

struct ConvertProgress {
  int frames = 0, frames_total = 0;
};

struct ConvertOptions {
  /** Store the pixels in the log instead of the paths of the image files. */
  bool embed = false;
  /** Called after every stereo frame. */
  std::function<void(const ConvertProgress&)> progress;
};

struct ConvertReport {
  int stereo_frames = 0, imu_samples = 0, ground_truth_poses = 0;
  bool embedded = false;
  /** What of the ground truth the format has no place for: "velocities", "biases" or both; empty:
   * nothing is lost. */
  std::string lost_truth;
};

/**
 * Writes what `source` still delivers into the rawlog `dst`, in time order, with stock classes of
 * MRPT only; open the source with an unlimited `imu_margin_s` to keep all of its IMU samples, and
 * without decoding unless `embed`.
 *
 * External images are referenced relative to the log's folder where they lie below it (log and
 * images can be moved together), by absolute path otherwise (found from anywhere, by any reader).
 *
 * @throws DataError if the log cannot be written, or if images are to stay external and the source
 * has no image files
 */
ConvertReport convertToRawlog(SensorSource& source, const std::string& dst,
                              const ConvertOptions& options = {});

/**
 * Writes what `source` still delivers as a EuRoC folder `dst`, images as PNG of 8 bits. Open the
 * source with decoding, and with an unlimited `imu_margin_s` to keep all of its IMU samples. Of the
 * ground truth's velocities and biases both are written or none (ConvertReport::lost_truth).
 * `options.embed` has no meaning.
 *
 * @throws ConfigError if `dst` is there and not empty, or if the source does not decode; DataError if
 * it cannot be written
 */
ConvertReport convertToEuroc(SensorSource& source, const std::string& dst,
                             const ConvertOptions& options = {});

/**
 * Writes what `source` still delivers as a ROS 1 bag `dst`, and Kalibr's camchain.yaml and imu.yaml
 * beside it: topics /cam0/image_raw, /cam1/image_raw (sensor_msgs/Image, mono8), /imu0
 * (sensor_msgs/Imu) and /ground_truth (geometry_msgs/PoseStamped, T_WB). Velocities and biases of
 * the ground truth are lost. Open the source as for convertToEuroc().
 *
 * @throws ConfigError if one of the two files is there with another calibration, or if the source
 * does not decode; DataError if they cannot be written
 */
ConvertReport convertToRosBag(SensorSource& source, const std::string& dst,
                              const ConvertOptions& options = {});

/**
 * The same as a ROS 2 bag in sqlite3, its file `dst` and metadata.yaml, as ROS 2 Humble writes it;
 * the folder is the bag.
 *
 * @throws as convertToRosBag(), and ConfigError if another bag is in the folder
 */
ConvertReport convertToRos2Bag(SensorSource& source, const std::string& dst,
                               const ConvertOptions& options = {});

}  // namespace etalon
