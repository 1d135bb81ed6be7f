#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bags/bag_file.h"
#include "bags/bag_streams.h"
#include "etalon/datasets/recording_reader.h"

namespace etalon {

/**
 * A bag of ROS 1, or of ROS 2 in sqlite3 files: the file, or ROS 2's folder with `metadata.yaml`.
 * The stamps are those of the messages' headers.
 *
 * Kalibr's `camchain.yaml` and `imu.yaml` come from the options, or lie beside the bag (in ROS 2's
 * folder, or beside it). Without the latter the IMU's noise is ImuNoiseDensities' default, with a
 * warning.
 */
class BagReader : public RecordingReader {
 public:
  static bool accepts(const std::string& path);

  /** @throws DataError if it cannot be opened */
  BagReader(std::string path, const RecordingOptions& options);

  Recording read() override;
  LoadedFrame load(size_t index, bool decode) override;
  std::pair<std::string, std::string> paths(size_t index) const override;
  std::vector<RecordingFile> files() const override;
  std::string calibrationFile(const std::string& sensor) const override;

 private:
  struct Pair {
    TimeNs t = 0;
    size_t left = 0, right = 0;  ///< handles
  };

  std::string beside(const std::string& file) const;
  TimeNs readCalibration(Recording* recording, KalibrTopics* topics) const;
  std::string nameOf(const std::string& topic) const;
  void readImages(TimeNs shift, Recording* recording);
  cv::Mat decode(const std::string& topic, size_t handle, size_t camera, std::string* problem);

  std::string path_;
  RecordingOptions options_;
  std::unique_ptr<BagFile> bag_;
  BagStreams streams_;
  std::vector<Pair> pairs_;
  StereoInertialCalibration calibration_;
};

}  // namespace etalon
