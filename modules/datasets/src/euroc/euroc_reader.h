#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/recording_reader.h"

namespace etalon {

/**
 * A folder in EuRoC's (ASL) layout, with or without ground truth:
 *
 *     [mav0/]cam0/{sensor.yaml, data.csv, data/<name>.png}, cam1/..., imu0/{sensor.yaml, data.csv},
 *     [state_groundtruth_estimate0/{data.csv, [sensor.yaml]}]
 *
 * With Kalibr's `camchain.yaml` beside cam0, or in the options, that is the calibration of the
 * cameras instead of their `sensor.yaml` (docs/cameras.md); with its `imu.yaml` in the options, that
 * is the noise of the IMU. Where the folder has no `sensor.yaml`, both are looked for in
 * `dso/camchain.yaml` and `dso/imu_config.yaml` beside `mav0`, as TUM-VI has them, and the ground
 * truth in `mocap0`.
 *
 * The body frame B is the IMU: T_BC = T_BS(imu0)^-1 T_BS(cam). Ground truth is brought to that
 * frame. Stamps stay exact to the nanosecond. Cameras are paired by stamps that are equal, or differ
 * by no more than the options' tolerance. A missing `rate_hz` is measured from the stamps.
 */
class EurocReader : public RecordingReader {
 public:
  /** Whether it is a folder with `mav0`, or with a folder of one of the sensors. */
  static bool accepts(const std::string& path);

  /** @throws DataError if the folders of the sensors are not there, ConfigError if the options have
   * topics */
  EurocReader(const std::string& path, const RecordingOptions& options);

  Recording read() override;
  LoadedFrame load(size_t index, bool decode) override;
  std::pair<std::string, std::string> paths(size_t index) const override;
  /** All files below `mav0` by their paths in it. */
  std::vector<RecordingFile> files() const override;
  std::string calibrationFile(const std::string& sensor) const override;

 private:
  struct ImageRow {
    TimeNs t = 0;
    std::string path;
    int line = 0;
  };
  struct Pair {
    TimeNs t = 0;
    std::string left, right;
  };

  /** The files of calibrations; empty if it is the sensors' own. */
  std::filesystem::path camchain() const;
  std::filesystem::path kalibrImu() const;
  /** Returns T_BS of the IMU. */
  SE3 readImu(Recording* recording) const;
  void useCamchain(Recording* recording, std::array<std::vector<ImageRow>, 2>* images) const;
  std::vector<ImageRow> readImageList(const std::string& camera) const;
  void pairImages(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right,
                  Recording* recording);

  std::filesystem::path root_;  ///< holds the sensors' folders
  RecordingOptions options_;
  std::vector<Pair> pairs_;
  StereoInertialCalibration calibration_;
};

}  // namespace etalon
