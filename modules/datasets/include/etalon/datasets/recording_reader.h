#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Everything of a recording but its pixels. */
struct Recording {
  StereoInertialCalibration calibration;
  GroundTruth ground_truth;
  std::vector<ImuSample> imu;        ///< strictly increasing in time
  std::vector<TimeNs> image_stamps;  ///< of the paired images, strictly increasing
  std::vector<TimeNs> unpaired_left, unpaired_right;
  std::vector<std::string> warnings;  ///< from reading it
};

/** A pair of images, or why there is none. */
struct LoadedFrame {
  StereoFrame frame;
  std::string file;     ///< the file that `problem` is about
  std::string problem;  ///< why the pair cannot be used; empty if it can
};

/** File and problem of a pair as a sentence; empty if there is none. */
std::string describe(const LoadedFrame& loaded);

/** A file that is part of a recording. */
struct RecordingFile {
  std::string path;
  /** What the recording calls it, wherever the recording lies, if that is part of what it says:
   * "cam0/data.csv". Empty where the bytes alone count. */
  std::string name;
};

/**
 * What one format of recordings does by itself; RecordedSource does the rest. A reader is made with
 * the path of a recording that it accepts, and its line in open_source.cpp makes it known
 * (docs/adding-a-reader.md).
 */
class RecordingReader {
 public:
  RecordingReader() = default;
  virtual ~RecordingReader() = default;
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  /**
   * Everything but the pixels; called once, before all others. An error at the end of a file is
   * found here, before a run starts.
   * @throws DataError naming the file, the line or object, and what was expected
   */
  virtual Recording read() = 0;

  /** Pair number `index` of Recording::image_stamps. Indices must not decrease from call to call.
   */
  virtual LoadedFrame load(size_t index, bool decode) = 0;

  /** The image files of a pair, left and right; empty if embedded. */
  virtual std::pair<std::string, std::string> paths(size_t index) const = 0;

  /** The files that the recording is made of, as far as they are there: another recording has other
   * bytes or names. The same order at every call. */
  virtual std::vector<RecordingFile> files() const = 0;

  /** The file that holds the calibration of a sensor, "cam0", "cam1" or "imu0": where to mend it.
   */
  virtual std::string calibrationFile(const std::string& sensor) const = 0;
};

}  // namespace etalon
