#include "rawlog/rawlog_reader.h"

#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/datasets/observation_conversion.h"
#include "image_file.h"
#include "recording_options.h"
#include "stamped_rows.h"

namespace etalon {

namespace fs = std::filesystem;
using mrpt::obs::CObservationStereoImages;

bool RawlogReader::accepts(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) == 0) return false;
  if (fs::path(path).extension() == ".rawlog") return true;
  std::ifstream in(path, std::ios::binary);
  std::string start(7, '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  // gzip, or the first object: the length of its class's name and that name.
  return start.compare(0, 2, "\x1f\x8b") == 0 || start.compare(1, 6, "mrpt::") == 0;
}

RawlogReader::RawlogReader(std::string path, const RecordingOptions& options)
    : path_(std::move(path)), own_truth_(options.own_truth) {
  refuseCalibrationOptions(options, path_, "a rawlog");
  refuseTopicOptions(options, path_, "a rawlog");
}

Recording RawlogReader::read() {
  RawlogScan scan = scanRawlog(path_, own_truth_);
  if (scan.frames.empty())
    throw DataError(path_, 0,
                    "expected CObservationStereoImages with a left and a right image, found none" +
                        scan.stereo.othersInWords());
  Recording recording;
  putInOrder(path_ + ": IMU '" + scan.imu.label.value_or("") + "'", "samples", &scan.imu_samples,
             &recording.warnings);
  if (scan.imu_samples.empty())
    throw DataError(path_, 0,
                    "expected CObservationIMU with all rates and accelerations, found none" +
                        scan.imu.othersInWords());
  recording.calibration = calibrationOf(scan, path_, &recording.warnings);
  recording.ground_truth.states = std::move(scan.truth);
  restoreExact(&scan, &recording.ground_truth);
  describeScan(scan, path_, &recording.warnings);
  recording.unpaired_left = scan.stereo.unusableStamps();
  recording.imu = std::move(scan.imu_samples);
  for (const RawlogFrame& frame : scan.frames) recording.image_stamps.push_back(frame.t);
  label_ = *scan.stereo.label;
  entries_ = std::move(scan.frames);
  calibration_ = recording.calibration;
  return recording;
}

LoadedFrame RawlogReader::load(size_t index, bool decode) {
  const RawlogFrame& entry = entries_.at(index);
  if (!entry.left_path.empty() && !entry.right_path.empty())
    return loadPair(entry.t, entry.left_path, entry.right_path, calibration_, decode);
  LoadedFrame result;
  result.frame.t = entry.t;
  result.file = path_;
  if (!decode) return result;
  try {
    const auto observation = observationAt(index);
    if (!entry.left_path.empty()) observation->imageLeft.setExternalStorage(entry.left_path);
    if (!entry.right_path.empty()) observation->imageRight.setExternalStorage(entry.right_path);
    result.frame = toStereoFrame(*observation);
    result.frame.t = entry.t;
  } catch (const DataError& e) {
    result.problem = e.what();
    return result;
  }
  result.problem = checkImage(result.frame.left, calibration_.cameras[0].model);
  if (result.problem.empty())
    result.problem = checkImage(result.frame.right, calibration_.cameras[1].model);
  if (!result.problem.empty())
    result.problem = "stereo frame at " + std::to_string(entry.t) + " ns: " + result.problem;
  return result;
}

std::pair<std::string, std::string> RawlogReader::paths(size_t index) const {
  return {entries_.at(index).left_path, entries_.at(index).right_path};
}

std::vector<RecordingFile> RawlogReader::files() const {
  std::vector<RecordingFile> files = {{path_, ""}};
  for (const RawlogFrame& entry : entries_)
    for (const std::string& path : {entry.left_path, entry.right_path})
      if (!path.empty() && fs::exists(path)) files.push_back({path, ""});
  return files;
}

std::string RawlogReader::calibrationFile(const std::string& /*sensor*/) const { return path_; }

CObservationStereoImages::Ptr RawlogReader::observationAt(size_t index) {
  if (!log_) log_ = std::make_unique<RawlogObservations>(path_);
  if (index < next_ && !(last_ && index + 1 == next_))
    throw DataError(path_, 0, "embedded images are read in the order of time");
  while (!last_ || next_ <= index) {
    const auto observation = log_->next();
    if (!observation) throw DataError(path_, 0, "the log became shorter while it was read");
    auto stereo = std::dynamic_pointer_cast<CObservationStereoImages>(observation);
    if (!stereo || stereo->sensorLabel != label_ || !stereo->hasImageRight) continue;
    last_ = std::move(stereo);
    ++next_;
  }
  return last_;
}

}  // namespace etalon
