#include "etalon/core/errors.h"
#include "etalon/datasets/euroc_folder.h"
#include "event_writer.h"

namespace etalon {

namespace {

class EurocWriter : public EventWriter {
 public:
  explicit EurocWriter(const std::string& dst)
      : folder_(dst, false, "remove it or choose another") {}

  void write(const ImuSample& sample) override { imu_.push_back(sample); }

  void write(const StereoFrame& frame) override {
    folder_.writeImage(0, frame.t, frame.left);
    folder_.writeImage(1, frame.t, frame.right);
    stamps_.push_back(frame.t);
  }

  void complete(const SensorSource& source) {
    folder_.writeCalibration(source.calibration(), "converted from " + source.name());
    folder_.writeImu(imu_);
    if (!source.groundTruth().empty()) folder_.writeGroundTruth(source.groundTruth());
    folder_.writeImageLists(stamps_);
    folder_.complete();
  }

 private:
  EurocFolder folder_;
  std::vector<ImuSample> imu_;
  std::vector<TimeNs> stamps_;
};

}  // namespace

ConvertReport writeEvents(SensorSource& source, const ConvertOptions& options,
                          EventWriter* writer) {
  ConvertReport report;
  report.embedded = true;
  while (const std::optional<SensorEvent> event = source.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      writer->write(*sample);
      ++report.imu_samples;
      continue;
    }
    const StereoFrame& frame = std::get<StereoFrame>(*event);
    if (frame.left.empty() || frame.right.empty())
      throw ConfigError(source.name() + ": expected a source that decodes its images");
    writer->write(frame);
    ++report.stereo_frames;
    if (options.progress)
      options.progress({report.stereo_frames, static_cast<int>(source.imageStamps().size()) -
                                                  source.statistics().unreadable_images});
  }
  const GroundTruth& truth = source.groundTruth();
  report.ground_truth_poses = static_cast<int>(truth.states.size());
  if (truth.has_velocity) report.lost_truth = "velocities";
  if (truth.has_biases) report.lost_truth += report.lost_truth.empty() ? "biases" : " and biases";
  return report;
}

ConvertReport convertToEuroc(SensorSource& source, const std::string& dst,
                             const ConvertOptions& options) {
  EurocWriter writer(dst);
  ConvertReport report = writeEvents(source, options, &writer);
  report.embedded = false;
  const GroundTruth& truth = source.groundTruth();
  if (truth.has_velocity && truth.has_biases) report.lost_truth.clear();
  writer.complete(source);
  return report;
}

}  // namespace etalon
