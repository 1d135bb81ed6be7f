#include "etalon/benchmark/sequence_tracks.h"

#include <cctype>
#include <filesystem>
#include <future>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>

#include "etalon/benchmark/content_hash.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/frontend/front_stage.h"
#include "etalon/imu/saturation.h"

namespace etalon {
namespace {

/** Decodes the pairs of a recording in order; with `ahead`, the next one while the last is used. */
class PairReader {
 public:
  PairReader(RecordedSource& recording, bool ahead) : recording_(recording), ahead_(ahead) {}
  ~PairReader() {
    if (next_.valid()) next_.wait();
  }
  PairReader(const PairReader&) = delete;
  PairReader& operator=(const PairReader&) = delete;

  LoadedFrame read(size_t index) {
    LoadedFrame result = next_.valid() ? next_.get() : recording_.loadFrame(index);
    if (ahead_ && index + 1 < recording_.imageStamps().size())
      next_ =
          std::async(std::launch::async, [this, index] { return recording_.loadFrame(index + 1); });
    return result;
  }

 private:
  RecordedSource& recording_;
  bool ahead_;
  std::future<LoadedFrame> next_;
};

}  // namespace

std::string recordingName(const std::string& source) {
  namespace fs = std::filesystem;
  fs::path path = fs::absolute(source).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  if (path.filename() == "mav0") path = path.parent_path();
  const bool file = path.extension() == ".rawlog" || path.extension() == ".bag";
  return (file ? path.stem() : path.filename()).string();
}

std::string fileName(const std::string& text) {
  std::string name = text;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 &&
        std::string("._+-").find(c) == std::string::npos)
      c = '_';
  return name;
}

void requireDifferentNames(const std::vector<std::string>& sources) {
  std::set<std::string> names;
  for (const std::string& source : sources)
    if (!names.insert(fileName(recordingName(source))).second)
      throw ConfigError("two recordings are called '" + fileName(recordingName(source)) +
                        "'; their folders or files need different names (" + source + ")");
}

SequenceTracks withoutTracks(const RecordedSource& recording) {
  SequenceTracks tracks;
  tracks.calibration = recording.calibration();
  tracks.ground_truth = recording.groundTruth();
  if (!recording.imageStamps().empty()) tracks.first_image = recording.imageStamps().front();
  SaturationDetector saturation;
  for (ImuSample sample : recording.imuMeasurements()) {
    saturation.mark(&sample);
    tracks.imu.add(sample);
  }
  return tracks;
}

TrackingOptions trackingOptions(const PipelineOptions& pipeline) {
  TrackingOptions options;
  options.frontend = pipeline.frontend;
  options.gyro_bias = pipeline.window.priors.mean.gyro;
  return options;
}

SequenceTracks trackSequence(RecordedSource& recording, const TrackingOptions& options) {
  SequenceTracks tracks = withoutTracks(recording);
  FrontStage front(tracks.calibration, options.frontend);
  const ImuBias bias{options.gyro_bias, Eigen::Vector3d::Zero()};
  std::vector<double> milliseconds;
  std::string first_problem;
  PairReader reader(recording, options.decode_ahead);
  const size_t pairs = recording.imageStamps().size();
  for (size_t i = 0; i < pairs; ++i) {
    if (options.stop && options.stop->load()) throw Interrupted();
    const LoadedFrame pair = reader.read(i);
    if (options.progress) options.progress(i + 1, pairs);
    if (!pair.problem.empty()) {
      ++tracks.unreadable_images;
      if (first_problem.empty()) first_problem = pair.problem;
      continue;
    }
    if (!tracks.imu.covers(pair.frame.t, pair.frame.t)) continue;
    FrontFrame frame = front.process(pair.frame, tracks.imu, bias);
    if (!frame.tracked) continue;
    tracks.frames.push_back(*std::move(frame.tracked));
    milliseconds.push_back(frame.ms);
  }
  if (tracks.frames.empty())
    throw DataError(recording.name(), 0,
                    first_problem.empty() ? "no stereo pair lies inside the IMU's time"
                                          : "no stereo pair can be read: " + first_problem);
  tracks.frontend_ms = median(std::move(milliseconds));
  return tracks;
}

std::string tracksKey(const std::string& recording_hash, const TrackingOptions& options) {
  StereoTrackerOptions frontend = options.frontend;
  ParameterSet parameters("frontend");
  frontend.declare(parameters);
  const std::string bias = format("%.17g %.17g %.17g", options.gyro_bias.x(), options.gyro_bias.y(),
                                  options.gyro_bias.z());
  ContentHash hash;
  hash.add(recording_hash);
  hash.add(parameters.toIni());
  hash.add(bias);
  hash.add(cv::getVersionString());
  hash.add(librariesHash({"core", "imu", "datasets", "frontend"}));
  return hash.hex();
}

}  // namespace etalon
