#include "bags/bag_reader.h"

#include <algorithm>
#include <filesystem>

#include "bags/ros1_bag.h"
#include "bags/ros2_bag.h"
#include "calibration/kalibr_camchain.h"
#include "calibration/kalibr_imu.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "image_file.h"
#include "stamped_rows.h"
#include "stereo_pairs.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

void noteAlone(const std::string& name, const std::vector<size_t>& alone,
               const std::vector<TimeNs>& stamps, std::vector<TimeNs>* unpaired,
               std::vector<std::string>* warnings) {
  for (const size_t i : alone) unpaired->push_back(stamps[i]);
  if (alone.empty()) return;
  warnings->push_back(name + format(": %zu without a counterpart (first: stamp %lld)", alone.size(),
                                    static_cast<long long>(stamps[alone.front()])));
}

}  // namespace

bool BagReader::accepts(const std::string& path) { return isRos1Bag(path) || isRos2Bag(path); }

BagReader::BagReader(std::string path, const RecordingOptions& options)
    : path_(std::move(path)),
      options_(options),
      bag_(isRos1Bag(path_) ? openRos1Bag(path_) : openRos2Bag(path_)) {}

/** The file of this name in the bag, if that is a folder, or beside it; empty if there is none. */
std::string BagReader::beside(const std::string& file) const {
  fs::path bag = fs::absolute(path_).lexically_normal();
  if (!bag.has_filename()) bag = bag.parent_path();  // it ended in '/'
  for (const fs::path& folder : {bag, bag.parent_path()}) {
    std::error_code error;
    if (fs::is_regular_file(folder / file, error)) return (folder / file).string();
  }
  return "";
}

std::string BagReader::calibrationFile(const std::string& sensor) const {
  const bool imu = sensor == "imu0";
  const std::string& option = imu ? options_.imu_yaml : options_.camchain;
  return option.empty() ? beside(imu ? "imu.yaml" : "camchain.yaml") : option;
}

/** Returns what is to be added to the stamps of images. */
TimeNs BagReader::readCalibration(Recording* recording, KalibrTopics* topics) const {
  const std::string chain_file = calibrationFile("cam0"), imu_file = calibrationFile("imu0");
  if (chain_file.empty())
    throw DataError(path_, 0,
                    "there is no calibration; expected Kalibr's camchain.yaml beside the bag, or "
                    "the option --camchain");
  const KalibrCamchain chain = readKalibrCamchain(chain_file);
  std::vector<std::string>& warnings = recording->warnings;
  warnings.insert(warnings.end(), chain.warnings.begin(), chain.warnings.end());
  for (size_t c = 0; c < 2; ++c) {
    recording->calibration.cameras[c].model = chain.models[c];
    recording->calibration.cameras[c].T_BC = chain.T_CI[c].inverse();
  }
  *topics = {chain.topics[0], chain.topics[1], ""};
  recording->calibration.imu.rate_hz = 0.0;
  if (imu_file.empty()) {
    warnings.push_back(path_ +
                       ": there is no imu.yaml of Kalibr beside the bag, and no option --imu-yaml: "
                       "the default noise of an IMU is taken");
  } else {
    const KalibrImu imu = readKalibrImu(imu_file);
    warnings.insert(warnings.end(), imu.warnings.begin(), imu.warnings.end());
    recording->calibration.imu = {imu.noise, imu.rate_hz.value_or(0.0)};
    topics->imu = imu.topic;
  }
  return durationNs(imageTimeShift(chain, chain_file, &warnings));
}

/** The topic, for messages. */
std::string BagReader::nameOf(const std::string& topic) const { return path_ + ": topic " + topic; }

void BagReader::readImages(TimeNs shift, Recording* recording) {
  std::vector<BagImageEntry> left = bag_->images(streams_.left);
  std::vector<BagImageEntry> right = bag_->images(streams_.right);
  putInOrder(nameOf(streams_.left), "messages", &left, &recording->warnings);
  putInOrder(nameOf(streams_.right), "messages", &right, &recording->warnings);
  shiftStamps(shift, nameOf(streams_.left), &left, &recording->warnings);
  shiftStamps(shift, nameOf(streams_.right), &right, &recording->warnings);
  const std::vector<TimeNs> left_stamps = stampsOf(left), right_stamps = stampsOf(right);
  const StereoPairs found = pairByStamps(left_stamps, right_stamps, options_.pair_tolerance_s);
  if (found.pairs.empty())
    throw DataError(path_, 0,
                    "no stereo pair was found; expected left and right images with equal stamps" +
                        adviseTolerance(left_stamps, right_stamps));
  for (const auto& [l, r] : found.pairs) {
    pairs_.push_back({left[l].t, left[l].handle, right[r].handle});
    recording->image_stamps.push_back(left[l].t);
  }
  if (const std::string offset = describeOffset(found); !offset.empty())
    recording->warnings.push_back(path_ + ": " + offset);
  if (const std::string advice = adviseOnAlone(found, left_stamps, right_stamps); !advice.empty())
    recording->warnings.push_back(path_ + ": " + advice);
  noteAlone(nameOf(streams_.left), found.alone_left, left_stamps, &recording->unpaired_left,
            &recording->warnings);
  noteAlone(nameOf(streams_.right), found.alone_right, right_stamps, &recording->unpaired_right,
            &recording->warnings);
  recording->calibration.cameras[0].rate_hz = measuredRate(left);
  recording->calibration.cameras[1].rate_hz = measuredRate(right);
}

Recording BagReader::read() {
  Recording recording;
  KalibrTopics kalibr;
  const TimeNs shift = readCalibration(&recording, &kalibr);
  streams_ = chooseStreams(bag_->topics(), options_, kalibr, path_);
  recording.imu = bag_->imu(streams_.imu);
  putInOrder(nameOf(streams_.imu), "messages", &recording.imu, &recording.warnings);
  double& rate_hz = recording.calibration.imu.rate_hz;
  if (rate_hz == 0.0) rate_hz = measuredRate(recording.imu);
  readImages(shift, &recording);
  if (options_.own_truth && !streams_.truth.empty()) {
    std::vector<StampedPose> poses = bag_->poses(streams_.truth);
    putInOrder(nameOf(streams_.truth), "messages", &poses, &recording.warnings);
    for (const StampedPose& pose : poses)
      recording.ground_truth.states.emplace_back(pose.t, pose.T_WB);
  }
  calibration_ = recording.calibration;
  return recording;
}

cv::Mat BagReader::decode(const std::string& topic, size_t handle, size_t camera,
                          std::string* problem) {
  cv::Mat gray = toGray(bag_->image(topic, handle), problem);
  if (problem->empty()) *problem = checkImage(gray, calibration_.cameras[camera].model);
  if (!problem->empty()) *problem = "topic " + printable(topic) + ": " + *problem;
  return gray;
}

LoadedFrame BagReader::load(size_t index, bool decode_images) {
  const Pair& pair = pairs_.at(index);
  LoadedFrame result;
  result.frame.t = pair.t;
  result.file = path_;
  if (!decode_images) return result;
  try {
    result.frame.left = decode(streams_.left, pair.left, 0, &result.problem);
    if (result.problem.empty())
      result.frame.right = decode(streams_.right, pair.right, 1, &result.problem);
  } catch (const DataError& e) {
    result.problem = e.what();
  }
  if (!result.problem.empty())
    result.problem = "stereo frame at " + std::to_string(pair.t) + " ns: " + result.problem;
  return result;
}

std::pair<std::string, std::string> BagReader::paths(size_t /*index*/) const { return {}; }

std::vector<RecordingFile> BagReader::files() const {
  std::vector<RecordingFile> files;
  for (const std::string& file : bag_->files()) files.push_back({file, ""});
  for (const char* sensor : {"cam0", "imu0"})
    if (const std::string file = calibrationFile(sensor); !file.empty())
      files.push_back({file, ""});
  return files;
}

}  // namespace etalon
