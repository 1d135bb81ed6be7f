#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/rawlog_observations.h"
#include "etalon/datasets/recording_reader.h"
#include "rawlog/rawlog_scan.h"

namespace etalon {

/**
 * An MRPT rawlog (gz-compressed or not), object by object.
 *
 * In a log that this project wrote, calibration, noise model and exact stamps come from its
 * comments (see recording_comment.h), and the streams are those that the comment names. In other
 * logs the first sensor label with a CObservationStereoImages that has a right image and the first
 * with a CObservationIMU that has all rates and accelerations are taken, calibration comes from the
 * observations, and the IMU's noise model is ImuNoiseDensities' default (with a warning).
 * Observations of other labels and classes are ignored. External images are looked for relative to
 * the log's folder, then in those where MRPT's tools put them; MRPT's process-wide base path is not
 * used.
 */
class RawlogReader : public RecordingReader {
 public:
  /** Whether it is a file. */
  static bool accepts(const std::string& path);

  /** @throws ConfigError if the options have anything set: a log says all of it */
  RawlogReader(std::string path, const RecordingOptions& options);

  /** Reads through the whole log once, so that a truncated one is found before a run starts. */
  Recording read() override;
  /** Images by path, or from a second pass through the log where they are embedded. */
  LoadedFrame load(size_t index, bool decode) override;
  std::pair<std::string, std::string> paths(size_t index) const override;
  /** The log and the images that it refers to, without names: they may have moved together. */
  std::vector<RecordingFile> files() const override;
  std::string calibrationFile(const std::string& sensor) const override;

 private:
  mrpt::obs::CObservationStereoImages::Ptr observationAt(size_t index);

  std::string path_, label_;
  bool own_truth_;
  std::vector<RawlogFrame> entries_;
  StereoInertialCalibration calibration_;
  std::unique_ptr<RawlogObservations> log_;
  mrpt::obs::CObservationStereoImages::Ptr last_;
  size_t next_ = 0;  ///< of the pair after last_
};

}  // namespace etalon
