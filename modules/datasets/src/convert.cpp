#include "etalon/datasets/convert.h"

#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recording_comment.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

/** The path of an image as it stands in a log in `folder` (absolute): relative if it lies below the
 * folder. */
std::string pathInLog(const std::string& image, const fs::path& folder) {
  const fs::path absolute = fs::absolute(image).lexically_normal();
  const fs::path relative = absolute.lexically_relative(folder);
  if (relative.empty() || *relative.begin() == "..") return absolute.string();
  return relative.string();
}

/** Writes the streams of one source. */
class Converter {
 public:
  Converter(SensorSource& source, const std::string& dst, const ConvertOptions& options)
      : source_(source),
        options_(options),
        folder_(fs::absolute(dst).lexically_normal().parent_path()),
        writer_(dst) {}

  ConvertReport run() {
    report_.embedded = options_.embed;
    while (const std::optional<SensorEvent> event = source_.next()) {
      if (!started_) writeHeader(stampOf(*event));
      started_ = true;
      last_stamp_ = stampOf(*event);
      writeGroundTruthUntil(last_stamp_);
      std::visit([this](const auto& e) { write(e); }, *event);
    }
    const GroundTruth& truth = source_.groundTruth();
    if (!truth.empty()) writeGroundTruthUntil(truth.states.back().t);
    index_.ground_truth = truth;
    writer_.write(commentObservation(last_stamp_, toJson(index_)));
    writer_.close();
    return report_;
  }

 private:
  void writeHeader(TimeNs t) {
    RecordingComment comment;
    comment.calibration = source_.calibration();
    comment.source = fs::absolute(source_.name()).lexically_normal().string();
    comment.source_kind = source_.kind();
    comment.images_embedded = options_.embed;
    comment.stereo_label = kStereoLabel;
    comment.imu_label = kImuLabel;
    comment.ground_truth_label = kGroundTruthLabel;
    writer_.write(commentObservation(t, toJson(comment)));
  }

  void writeGroundTruthUntil(TimeNs t) {
    const auto& states = source_.groundTruth().states;
    for (; truth_ < states.size() && states[truth_].t <= t; ++truth_) {
      writer_.write(
          toObservation(StampedPose{states[truth_].t, states[truth_].T_WB}, kGroundTruthLabel));
      ++report_.ground_truth_poses;
    }
  }

  void write(const ImuSample& sample) {
    writer_.write(toObservation(sample));
    index_.imu_stamps.push_back(sample.t);
    ++report_.imu_samples;
  }

  void write(StereoFrame frame) {
    if (options_.embed) {
      if (frame.left.empty() || frame.right.empty())
        throw ConfigError("embedding needs a source that decodes its images");
    } else {
      if (frame.left_path.empty() || frame.right_path.empty())
        throw DataError(source_.name(), 0,
                        "its images are embedded; expected image files, or the option --embed");
      frame.left_path = pathInLog(frame.left_path, folder_);
      frame.right_path = pathInLog(frame.right_path, folder_);
    }
    writer_.write(toObservation(frame, source_.calibration(), !options_.embed));
    index_.image_stamps.push_back(frame.t);
    ++report_.stereo_frames;
    if (options_.progress)
      options_.progress({report_.stereo_frames, static_cast<int>(source_.imageStamps().size()) -
                                                    source_.statistics().unreadable_images});
  }

  SensorSource& source_;
  const ConvertOptions& options_;
  fs::path folder_;
  RawlogWriter writer_;
  RecordingIndex index_;
  ConvertReport report_;
  TimeNs last_stamp_ = 0;
  bool started_ = false;
  size_t truth_ = 0;
};

}  // namespace

ConvertReport convertToRawlog(SensorSource& source, const std::string& dst,
                              const ConvertOptions& options) {
  return Converter(source, dst, options).run();
}

}  // namespace etalon
