#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Everything of a recording but its pixels. */
struct Recording {
  std::string name;  ///< path
  std::string kind;  ///< "euroc" or "rawlog"
  StereoInertialCalibration calibration;
  GroundTruth ground_truth;
  std::vector<ImuSample> imu;        ///< strictly increasing in time
  std::vector<TimeNs> image_stamps;  ///< of the paired images, strictly increasing
  std::vector<TimeNs> unpaired_left, unpaired_right;
  std::vector<std::string> warnings;  ///< from opening it
};

/** Fetches the images of a recording, one pair at a time. */
class FrameLoader {
 public:
  struct Result {
    StereoFrame frame;
    std::string file;     ///< the file that `problem` is about
    std::string problem;  ///< why the pair cannot be used; empty if it can
  };

  virtual ~FrameLoader() = default;
  /** Pair number `index` of Recording::image_stamps. Indices must not decrease from call to call.
   */
  virtual Result load(size_t index, bool decode) = 0;
  /** The image files of a pair, left and right; empty if embedded. */
  virtual std::pair<std::string, std::string> paths(size_t index) const = 0;
};

/** Merges the streams of a recording in time order. Nothing but the current pair of images is held
 * in memory. */
class RecordedSource : public SensorSource {
 public:
  RecordedSource(Recording recording, std::unique_ptr<FrameLoader> loader,
                 const SourceOptions& options);

  const std::string& name() const override { return recording_.name; }
  std::string kind() const override { return recording_.kind; }
  const StereoInertialCalibration& calibration() const override { return recording_.calibration; }
  const GroundTruth& groundTruth() const override { return recording_.ground_truth; }
  const std::vector<TimeNs>& imageStamps() const override { return recording_.image_stamps; }
  std::optional<SensorEvent> next() override;
  const ReadStatistics& statistics() const override { return statistics_; }

  /** All of the recording's IMU samples, whatever the options' range. */
  const std::vector<ImuSample>& imuSamples() const { return recording_.imu; }

  /** Pair number `index` of imageStamps(), decoded; apart from next(). Indices must not decrease
   * from call to call. */
  FrameLoader::Result loadFrame(size_t index) { return loader_->load(index, true); }

  /** What is wrong with the image files of pair number `index`, as far as their headers show it;
   * the frame of the result has no images. Any index, at any time. */
  FrameLoader::Result checkFrame(size_t index) const;

  /** The image files of pair number `index`, left and right; empty if embedded. */
  std::pair<std::string, std::string> framePaths(size_t index) const {
    return loader_->paths(index);
  }

 private:
  void selectRange();
  void countUnpaired();
  void countOutsideImu();
  void warn(const std::string& sentence);
  std::optional<StereoFrame> nextFrame();

  Recording recording_;
  std::unique_ptr<FrameLoader> loader_;
  SourceOptions options_;
  ReadStatistics statistics_;
  TimeNs range_begin_ = 0, range_end_ = 0;  ///< stamps, both inclusive
  size_t frame_ = 0, frame_end_ = 0;        ///< next pair, one past the last pair of the range
  size_t imu_ = 0, imu_end_ = 0;
};

/** Like openSource, for those who need more of a recording than its events. */
std::unique_ptr<RecordedSource> openRecording(const std::string& path,
                                              const SourceOptions& options = {});

}  // namespace etalon
