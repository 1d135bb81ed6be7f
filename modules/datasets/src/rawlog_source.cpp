#include "etalon/datasets/rawlog_source.h"

#include <mrpt/obs/CObservationComment.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calibration/yaml_map.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/recording_comment.h"
#include "path_frame_loader.h"
#include "rawlog_reader.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;
using mrpt::obs::CObservationStereoImages;

/** Where the images of one stereo observation are. */
struct FrameEntry {
  TimeNs t = 0;
  size_t ordinal = 0;                 ///< among the stereo observations of the label
  std::string left_path, right_path;  ///< empty if embedded
};

/** What one pass through a log collects. */
struct Scan {
  std::optional<RecordingComment> comment;
  std::optional<RecordingIndex> index;
  std::string stereo_label, imu_label;
  std::string ground_truth_label = kGroundTruthLabel;
  std::vector<FrameEntry> frames;
  size_t stereo_observations = 0;
  std::vector<ImuSample> imu;
  std::vector<GroundTruthState> truth;
  std::optional<CObservationStereoImages> first_stereo;  ///< without its images
  SE3 T_RB;
  std::vector<TimeNs> without_right;
  size_t incomplete_imu = 0;
  std::vector<std::string> other_labels;
};

class Scanner {
 public:
  explicit Scanner(const std::string& path) : path_(path), reader_(path) {}

  Scan run() {
    while (const auto observation = reader_.next()) {
      using namespace mrpt::obs;
      if (const auto* comment = dynamic_cast<CObservationComment*>(observation.get()))
        add(*comment);
      else if (const auto* stereo = dynamic_cast<CObservationStereoImages*>(observation.get()))
        add(*stereo);
      else if (const auto* imu = dynamic_cast<CObservationIMU*>(observation.get()))
        add(*imu);
      else if (const auto* pose = dynamic_cast<CObservationRobotPose*>(observation.get()))
        add(*pose);
    }
    return std::move(scan_);
  }

 private:
  /** Whether the observation is of the chosen stream; the first label is chosen where no comment
   * chose. */
  bool chosen(const std::string& label, std::string* stream, bool none_yet) {
    if (!scan_.comment && none_yet && stream->empty()) *stream = label;
    if (label == *stream) return true;
    if (!scan_.comment &&
        std::count(scan_.other_labels.begin(), scan_.other_labels.end(), label) == 0)
      scan_.other_labels.push_back(label);
    return false;
  }

  template <typename Elements>
  void checkStamp(TimeNs t, const Elements& elements, const std::string& what) const {
    if (!isStamp(t))
      throw DataError(path_, 0,
                      reader_.where() + ": expected stamps of the " + what +
                          " of the years 1970 to 2096, found " + std::to_string(t) + " ns");
    if (!elements.empty() && t <= elements.back().t)
      throw DataError(path_, 0,
                      reader_.where() + ": expected strictly increasing stamps of the " + what +
                          ", found " + std::to_string(t) + " ns after " +
                          std::to_string(elements.back().t) + " ns");
  }

  void add(const mrpt::obs::CObservationComment& comment) {
    const std::string format = formatOfComment(comment.text);
    if (format == kRecordingFormat && !scan_.comment) {
      scan_.comment = recordingCommentFromJson(comment.text, path_);
      scan_.stereo_label = scan_.comment->stereo_label;
      scan_.imu_label = scan_.comment->imu_label;
      scan_.ground_truth_label = scan_.comment->ground_truth_label;
    } else if (format == kIndexFormat && !scan_.index) {
      scan_.index = recordingIndexFromJson(comment.text, path_);
    }
  }

  void add(const CObservationStereoImages& stereo) {
    if (!chosen(stereo.sensorLabel, &scan_.stereo_label, !scan_.first_stereo)) return;
    FrameEntry entry;
    entry.t = fromMrptTime(stereo.timestamp);
    entry.ordinal = scan_.stereo_observations++;
    if (!scan_.first_stereo) {
      scan_.first_stereo = stereo;
      scan_.first_stereo->imageLeft = scan_.first_stereo->imageRight = mrpt::img::CImage();
    }
    if (!stereo.hasImageRight) {
      scan_.without_right.push_back(entry.t);
      return;
    }
    checkStamp(entry.t, scan_.frames, "stereo images '" + scan_.stereo_label + "'");
    const fs::path folder = fs::absolute(path_).parent_path();
    const auto resolve = [&](const mrpt::img::CImage& image) {
      return image.isExternallyStored() ? (folder / image.getExternalStorageFile()).string() : "";
    };
    entry.left_path = resolve(stereo.imageLeft);
    entry.right_path = resolve(stereo.imageRight);
    scan_.frames.push_back(std::move(entry));
  }

  void add(const mrpt::obs::CObservationIMU& imu) {
    if (!chosen(imu.sensorLabel, &scan_.imu_label, scan_.imu.empty())) return;
    const std::optional<ImuSample> sample = toImuSample(imu);
    if (!sample) {
      ++scan_.incomplete_imu;
      return;
    }
    if (!sample->gyro.allFinite() || !sample->accel.allFinite())
      throw DataError(path_, 0, reader_.where() + ": expected finite IMU measurements");
    checkStamp(sample->t, scan_.imu, "IMU '" + scan_.imu_label + "'");
    if (scan_.imu.empty()) scan_.T_RB = fromMrptPose(imu.sensorPose);
    scan_.imu.push_back(*sample);
  }

  void add(const mrpt::obs::CObservationRobotPose& pose) {
    if (pose.sensorLabel != scan_.ground_truth_label) return;
    GroundTruthState state;
    state.t = fromMrptTime(pose.timestamp);
    state.T_WB = fromMrptPose(pose.pose.mean);
    if (!state.T_WB.matrix().allFinite())
      throw DataError(path_, 0, reader_.where() + ": expected a finite pose of the ground truth");
    checkStamp(state.t, scan_.truth, "ground truth");
    scan_.truth.push_back(state);
  }

  std::string path_;
  RawlogReader reader_;
  Scan scan_;
};

/** Replaces `t`, cut down to MRPT's tick, by the exact stamp where the index knows it; its place in
 * the list. */
template <typename Elements, typename Stamp>
std::optional<size_t> findExact(TimeNs t, const Elements& exact, Stamp stamp) {
  const auto found = std::lower_bound(exact.begin(), exact.end(), t,
                                      [&](const auto& e, TimeNs v) { return stamp(e) < v; });
  if (found == exact.end() || truncateToMrptTick(stamp(*found)) != t) return std::nullopt;
  return static_cast<size_t>(found - exact.begin());
}

void restoreExact(const RecordingIndex& index, Scan* scan, GroundTruth* truth) {
  const auto itself = [](TimeNs t) { return t; };
  for (FrameEntry& frame : scan->frames)
    if (const auto i = findExact(frame.t, index.image_stamps, itself))
      frame.t = index.image_stamps[*i];
  for (ImuSample& sample : scan->imu)
    if (const auto i = findExact(sample.t, index.imu_stamps, itself))
      sample.t = index.imu_stamps[*i];
  truth->has_velocity = index.ground_truth.has_velocity;
  truth->has_biases = index.ground_truth.has_biases;
  for (GroundTruthState& state : truth->states) {
    const auto i = findExact(state.t, index.ground_truth.states,
                             [](const GroundTruthState& s) { return s.t; });
    if (!i) {
      truth->has_velocity = truth->has_biases = false;
      continue;
    }
    const GroundTruthState& exact = index.ground_truth.states[*i];
    state.t = exact.t;
    state.v_WB = exact.v_WB;
    state.b_g = exact.b_g;
    state.b_a = exact.b_a;
  }
}

/** Images by path, or from a second pass through the log where they are embedded. */
class RawlogFrameLoader : public FrameLoader {
 public:
  RawlogFrameLoader(std::string path, std::string label, std::vector<FrameEntry> entries,
                    const StereoInertialCalibration& calibration)
      : path_(std::move(path)),
        label_(std::move(label)),
        entries_(std::move(entries)),
        calibration_(calibration) {}

  Result load(size_t index, bool decode) override {
    const FrameEntry& entry = entries_.at(index);
    if (!entry.left_path.empty() && !entry.right_path.empty())
      return loadPair(entry.t, entry.left_path, entry.right_path, calibration_, decode);
    Result result;
    result.frame.t = entry.t;
    result.file = path_;
    if (!decode) return result;
    try {
      const auto observation = observationAt(entry.ordinal);
      result.frame = toStereoFrame(*observation, fs::absolute(path_).parent_path().string());
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

  std::pair<std::string, std::string> paths(size_t index) const override {
    return {entries_.at(index).left_path, entries_.at(index).right_path};
  }

 private:
  CObservationStereoImages::Ptr observationAt(size_t ordinal) {
    if (!reader_) reader_ = std::make_unique<RawlogReader>(path_);
    if (ordinal < next_ordinal_ && !(last_ && ordinal + 1 == next_ordinal_))
      throw DataError(path_, 0, "embedded images are read in the order of time");
    while (!last_ || next_ordinal_ <= ordinal) {
      const auto observation = reader_->next();
      if (!observation) throw DataError(path_, 0, "the log became shorter while it was read");
      auto stereo = std::dynamic_pointer_cast<CObservationStereoImages>(observation);
      if (!stereo || stereo->sensorLabel != label_) continue;
      last_ = std::move(stereo);
      ++next_ordinal_;
    }
    return last_;
  }

  std::string path_, label_;
  std::vector<FrameEntry> entries_;
  StereoInertialCalibration calibration_;
  std::unique_ptr<RawlogReader> reader_;
  CObservationStereoImages::Ptr last_;
  size_t next_ordinal_ = 0;  ///< of the observation after last_
};

template <typename Elements>
double measuredRate(const Elements& elements, double fallback) {
  if (elements.size() < 2) return fallback;
  return static_cast<double>(elements.size() - 1) /
         secondsBetween(elements.front().t, elements.back().t);
}

StereoInertialCalibration calibrationOf(const Scan& scan, const std::string& path,
                                        std::vector<std::string>* warnings) {
  if (scan.comment) return scan.comment->calibration;
  StereoInertialCalibration calibration = calibrationOf(
      *scan.first_stereo, scan.T_RB, path + ", stereo observation '" + scan.stereo_label + "'");
  for (CameraCalibration& camera : calibration.cameras)
    camera.rate_hz = measuredRate(scan.frames, camera.rate_hz);
  calibration.imu.rate_hz = measuredRate(scan.imu, calibration.imu.rate_hz);
  warnings->push_back(path +
                      ": no noise model of the IMU in the log; the densities of an ADIS16448 are "
                      "assumed (gyro 1.6968e-4 rad/s/sqrt(Hz), accelerometer 2e-3 m/s^2/sqrt(Hz))");
  const SE3& T_BC = calibration.cameras[0].T_BC;
  if (T_BC.matrix().isIdentity(1e-9))
    warnings->push_back(path +
                        ": left camera and IMU have the same pose on the robot; are the sensors' "
                        "poses set?");
  return calibration;
}

/** What is not usable as a calibration, whoever wrote the log. */
void checkCalibration(const StereoInertialCalibration& calibration, const std::string& path) {
  const auto require = [&path](bool condition, const std::string& expected) {
    if (!condition)
      throw DataError(path, 0, "the calibration cannot be used: expected " + expected);
  };
  for (size_t c = 0; c < 2; ++c) {
    const auto& [m, T_BC, rate_hz] = calibration.cameras[c];
    const std::string camera = " of cam" + std::to_string(c);
    require(1 <= m.width() && m.width() <= 100'000 && 1 <= m.height() && m.height() <= 100'000,
            "a size" + camera + " of 1 to 100000 pixels");
    require(T_BC.t.allFinite(), "finite numbers" + camera);
    require(std::isfinite(rate_hz) && rate_hz >= 0, "a rate" + camera + " that is not negative");
    checkedRotation(T_BC.R, path, 0, "T_BC" + camera, nullptr);
  }
  const auto& [noise, rate_hz] = calibration.imu;
  for (const double value : {noise.gyro_noise_density, noise.gyro_random_walk,
                             noise.accel_noise_density, noise.accel_random_walk, rate_hz})
    require(std::isfinite(value) && value >= 0,
            "noise densities and a rate of the IMU that are not negative");
}

void describeScan(const Scan& scan, const std::string& path, std::vector<std::string>* warnings) {
  if (scan.comment && !scan.index)
    warnings->push_back(path +
                        ": the index at the log's end is missing (was the log cut?): stamps are "
                        "those of MRPT's clock, 100 ns");
  if (scan.incomplete_imu > 0)
    warnings->push_back(path + ": " + std::to_string(scan.incomplete_imu) +
                        " IMU observations without all rates and accelerations were ignored");
  const std::string used =
      "' is ignored; used are '" + scan.stereo_label + "' and '" + scan.imu_label + "'";
  for (const std::string& label : scan.other_labels) {
    std::string sentence = path;
    sentence.append(": the sensor '").append(label).append(used);
    warnings->push_back(std::move(sentence));
  }
  if (!scan.without_right.empty())
    warnings->push_back(path + ": " + std::to_string(scan.without_right.size()) +
                        " stereo observations have no right image");
}

}  // namespace

std::unique_ptr<RecordedSource> openRawlog(const std::string& path, const SourceOptions& options) {
  Scan scan = Scanner(path).run();
  if (scan.frames.empty())
    throw DataError(path, 0,
                    "expected CObservationStereoImages with a left and a right image, found none");
  if (scan.imu.empty())
    throw DataError(path, 0, "expected CObservationIMU with rates and accelerations, found none");
  Recording recording;
  recording.name = path;
  recording.kind = "rawlog";
  recording.calibration = calibrationOf(scan, path, &recording.warnings);
  checkCalibration(recording.calibration, path);
  recording.ground_truth.states = std::move(scan.truth);
  if (scan.index) restoreExact(*scan.index, &scan, &recording.ground_truth);
  describeScan(scan, path, &recording.warnings);
  recording.unpaired_left = scan.without_right;
  recording.imu = std::move(scan.imu);
  for (const FrameEntry& frame : scan.frames) recording.image_stamps.push_back(frame.t);
  auto loader = std::make_unique<RawlogFrameLoader>(path, scan.stereo_label, std::move(scan.frames),
                                                    recording.calibration);
  return std::make_unique<RecordedSource>(std::move(recording), std::move(loader), options);
}

}  // namespace etalon
