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
};

/**
 * Writes what `source` still delivers into the rawlog `dst`, in time order, with stock classes of
 * MRPT only; open the source with an unlimited `imu_lead_s` to keep all of its IMU samples, and
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

}  // namespace etalon
