#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/recording_reader.h"

namespace etalon {

/** Merges the streams of a recording in time order. Of its pixels no more than the current pair is
 * held in memory; IMU samples, ground truth, stamps and paths are held for all of it. */
class RecordedSource : public SensorSource {
 public:
  /**
   * @param name path of the recording
   * @param kind of its format, see SensorSource::kind()
   * @throws DataError if there are no pairs of images or no IMU samples, as reader->read() does
   */
  RecordedSource(std::string name, std::string kind, std::unique_ptr<RecordingReader> reader,
                 const SourceOptions& options);

  const std::string& name() const override { return name_; }
  std::string kind() const override { return kind_; }
  const StereoInertialCalibration& calibration() const override { return recording_.calibration; }
  const GroundTruth& groundTruth() const override { return recording_.ground_truth; }
  const std::vector<TimeNs>& imageStamps() const override { return recording_.image_stamps; }
  std::optional<SensorEvent> next() override;
  const ReadStatistics& statistics() const override { return statistics_; }

  /** With which it was opened. */
  const SourceOptions& options() const { return options_; }

  /** All of the recording's IMU samples, whatever the options' range. */
  const std::vector<ImuSample>& imuSamples() const { return recording_.imu; }
  /** Those of imuSamples() that are measurements (isMeasurement()): the others are dropped by
   * whatever integrates them, and counted by checkImu(). */
  std::vector<ImuSample> imuMeasurements() const;

  /** Pair number `index` of imageStamps(), decoded; apart from next(). Indices must not decrease
   * from call to call. */
  LoadedFrame loadFrame(size_t index) { return reader_->load(index, true); }

  /** What the headers of the image files of pair number `index` show to be wrong with them;
   * the frame of the result has no images. Any index, at any time. */
  LoadedFrame checkFrame(size_t index) const;

  /** The image files of pair number `index`, left and right; empty if embedded. */
  std::pair<std::string, std::string> framePaths(size_t index) const {
    return reader_->paths(index);
  }

  /** See RecordingReader::files(). */
  std::vector<RecordingFile> files() const { return reader_->files(); }

  /** See RecordingReader::calibrationFile(). */
  std::string calibrationFile(const std::string& sensor) const {
    return reader_->calibrationFile(sensor);
  }

 private:
  void checkStampUnit() const;
  void checkImuRate();
  void selectRange();
  void countUnpaired();
  void countOutsideImu();
  void warn(const std::string& sentence);
  std::optional<StereoFrame> nextFrame();

  std::string name_, kind_;
  std::unique_ptr<RecordingReader> reader_;
  Recording recording_;
  SourceOptions options_;
  ReadStatistics statistics_;
  TimeNs range_begin_ = 0, range_end_ = 0;  ///< stamps, both inclusive
  size_t frame_ = 0, frame_end_ = 0;        ///< next pair, one past the last pair of the range
  size_t imu_ = 0, imu_end_ = 0;
};

/** Like openSource, for those who need more of a recording than its events. */
std::unique_ptr<RecordedSource> openRecording(const std::string& path,
                                              const SourceOptions& options = {});

/** Whether it is a recording, or by its name should be one: openRecording() reads it or says what is
 * wrong with it. */
bool isRecording(const std::string& path);

}  // namespace etalon
