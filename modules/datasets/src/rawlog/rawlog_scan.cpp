#include "rawlog/rawlog_scan.h"

#include <mrpt/obs/CObservationComment.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calibration/yaml_map.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_observations.h"
#include "stamped_rows.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;
using mrpt::obs::CObservationStereoImages;

/** Where a log's external images with relative paths may be: in its own folder, or where MRPT's tools
 * put them. CRawlog::detectImagesDirectory() has the names, but loses a slash in MRPT 2.5. */
std::vector<fs::path> imageFolders(const std::string& log) {
  const fs::path folder = fs::absolute(log).parent_path();
  const std::string name = fs::path(log).stem().string();
  return {folder, folder / (name + "_Images"), folder / (name + "_images"),
          folder / (name + "_IMAGES"), folder / "Images"};
}

class Scanner {
 public:
  Scanner(const std::string& path, bool with_truth)
      : path_(path), with_truth_(with_truth), image_folders_(imageFolders(path)), reader_(path) {
    scan_.ground_truth_label = kGroundTruthLabel;
  }

  RawlogScan run() {
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
      scan_.stereo.label = scan_.comment->stereo_label;
      scan_.imu.label = scan_.comment->imu_label;
      scan_.ground_truth_label = scan_.comment->ground_truth_label;
    } else if (format == kIndexFormat && !scan_.index) {
      scan_.index = recordingIndexFromJson(comment.text, path_);
    }
  }

  /** Of an image's file; empty if the image is embedded. */
  std::string externalPath(const mrpt::img::CImage& image) const {
    if (!image.isExternallyStored()) return "";
    const std::string& name = image.getExternalStorageFile();
    std::error_code ignored;
    for (const fs::path& folder : image_folders_)
      if (fs::exists(folder / name, ignored)) return (folder / name).string();
    return (image_folders_.front() / name).string();
  }

  void add(const CObservationStereoImages& stereo) {
    RawlogFrame entry;
    entry.t = fromMrptTime(stereo.timestamp);
    if (!scan_.stereo.takes(stereo.sensorLabel, entry.t, stereo.hasImageRight)) return;
    if (!scan_.first_stereo) {
      scan_.first_stereo = stereo;
      scan_.first_stereo->imageLeft = scan_.first_stereo->imageRight = mrpt::img::CImage();
    }
    checkStamp(entry.t, scan_.frames, "stereo images '" + stereo.sensorLabel + "'");
    entry.left_path = externalPath(stereo.imageLeft);
    entry.right_path = externalPath(stereo.imageRight);
    scan_.frames.push_back(std::move(entry));
  }

  void add(const mrpt::obs::CObservationIMU& imu) {
    const std::optional<ImuSample> sample = toImuSample(imu);
    if (!scan_.imu.takes(imu.sensorLabel, fromMrptTime(imu.timestamp), sample.has_value())) return;
    if (scan_.imu_samples.empty()) scan_.T_RB = fromMrptPose(imu.sensorPose);
    scan_.imu_samples.push_back(*sample);
  }

  void add(const mrpt::obs::CObservationRobotPose& pose) {
    if (!with_truth_ || pose.sensorLabel != scan_.ground_truth_label) return;
    StampedState state;
    state.t = fromMrptTime(pose.timestamp);
    state.T_WB = fromMrptPose(pose.pose.mean);
    if (!state.T_WB.matrix().allFinite())
      throw DataError(path_, 0, reader_.where() + ": expected a finite pose of the ground truth");
    checkStamp(state.t, scan_.truth, "ground truth");
    scan_.truth.push_back(state);
  }

  std::string path_;
  bool with_truth_;
  std::vector<fs::path> image_folders_;
  RawlogObservations reader_;
  RawlogScan scan_;
};

/** Replaces `t`, cut down to MRPT's tick, by the exact stamp where the index knows it; its place in
 * the list. */
template <typename Elements, typename Stamp>
std::optional<size_t> findExact(TimeNs t, const Elements& exact, Stamp stamp) {
  const auto found = std::lower_bound(exact.begin(), exact.end(), t,
                                      [&](const auto& e, TimeNs v) { return stamp(e) < v; });
  if (found == exact.end() || truncateToMrptTick(stamp(*found)) != t) return std::nullopt;
  return found - exact.begin();
}

/** Throws if the log has no usable calibration, whoever wrote it. */
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

}  // namespace

bool RawlogStream::takes(const std::string& observed_label, TimeNs t, bool is_usable) {
  if (!label && is_usable) label = observed_label;
  if (is_usable && observed_label == label) return true;
  std::vector<TimeNs>& stamps = unusable[observed_label];
  if (!is_usable) stamps.push_back(t);
  return false;
}

std::vector<TimeNs> RawlogStream::unusableStamps() const {
  const auto found = label ? unusable.find(*label) : unusable.end();
  return found == unusable.end() ? std::vector<TimeNs>() : found->second;
}

std::string RawlogStream::othersInWords() const {
  std::string text;
  for (const auto& [other, stamps] : unusable)
    text += (text.empty() ? "; there are others, of '" : ", '") + other + "'";
  return text;
}

RawlogScan scanRawlog(const std::string& path, bool with_truth) {
  return Scanner(path, with_truth).run();
}

void restoreExact(RawlogScan* scan, GroundTruth* truth) {
  if (!scan->index) return;
  const RecordingIndex& index = *scan->index;
  const auto itself = [](TimeNs t) { return t; };
  for (RawlogFrame& frame : scan->frames)
    if (const auto i = findExact(frame.t, index.image_stamps, itself))
      frame.t = index.image_stamps[*i];
  for (ImuSample& sample : scan->imu_samples)
    if (const auto i = findExact(sample.t, index.imu_stamps, itself))
      sample.t = index.imu_stamps[*i];
  truth->has_velocity = index.ground_truth.has_velocity;
  truth->has_biases = index.ground_truth.has_biases;
  for (StampedState& state : truth->states) {
    const auto i =
        findExact(state.t, index.ground_truth.states, [](const StampedState& s) { return s.t; });
    if (!i) {
      truth->has_velocity = truth->has_biases = false;
      continue;
    }
    const StampedState& exact = index.ground_truth.states[*i];
    state.t = exact.t;
    state.v_WB = exact.v_WB;
    state.bias = exact.bias;
  }
}

StereoInertialCalibration calibrationOf(const RawlogScan& scan, const std::string& path,
                                        std::vector<std::string>* warnings) {
  if (scan.comment) {
    checkCalibration(scan.comment->calibration, path);
    return scan.comment->calibration;
  }
  StereoInertialCalibration calibration = calibrationOf(
      *scan.first_stereo, scan.T_RB, path + ", stereo observation '" + *scan.stereo.label + "'");
  for (CameraCalibration& camera : calibration.cameras)
    if (scan.frames.size() > 1) camera.rate_hz = measuredRate(scan.frames);
  if (scan.imu_samples.size() > 1) calibration.imu.rate_hz = measuredRate(scan.imu_samples);
  warnings->push_back(path +
                      ": no noise model of the IMU in the log; the densities of an ADIS16448 are "
                      "assumed (gyro 1.6968e-4 rad/s/sqrt(Hz), accelerometer 2e-3 m/s^2/sqrt(Hz))");
  const SE3& T_BC = calibration.cameras[0].T_BC;
  if (T_BC.matrix().isIdentity(1e-9))
    warnings->push_back(path +
                        ": left camera and IMU have the same pose on the robot; are the sensors' "
                        "poses set?");
  checkCalibration(calibration, path);
  return calibration;
}

void describeScan(const RawlogScan& scan, const std::string& path,
                  std::vector<std::string>* warnings) {
  if (scan.comment && !scan.index)
    warnings->push_back(path +
                        ": the index at the log's end is missing (was the log cut?): stamps are "
                        "those of MRPT's clock, 100 ns");
  if (const size_t count = scan.imu.unusableStamps().size(); count > 0)
    warnings->push_back(path + ": " + std::to_string(count) +
                        " IMU observations without all rates and accelerations were ignored");
  const std::string used =
      "' is ignored; used are '" + *scan.stereo.label + "' and '" + *scan.imu.label + "'";
  for (const RawlogStream* stream : {&scan.stereo, &scan.imu})
    for (const auto& [label, stamps] : stream->unusable)
      if (!scan.comment && label != stream->label)
        warnings->push_back(std::string(path).append(": the sensor '").append(label).append(used));
  if (const size_t count = scan.stereo.unusableStamps().size(); count > 0)
    warnings->push_back(path + ": " + std::to_string(count) +
                        " stereo observations have no right image");
}

}  // namespace etalon
