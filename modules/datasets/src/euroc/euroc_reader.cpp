#include "euroc/euroc_reader.h"

#include <algorithm>

#include "calibration/kalibr_camchain.h"
#include "calibration/kalibr_imu.h"
#include "calibration/sensor_yaml.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/euroc_files.h"
#include "euroc/csv_reader.h"
#include "image_file.h"
#include "recording_options.h"
#include "stamped_rows.h"
#include "stereo_pairs.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

/** Brings states of the frame S to the IMU's frame B, T_SB known. */
void moveToImu(const SE3& T_SB, GroundTruth* truth) {
  const bool lever_arm = T_SB.t.norm() > 1e-9;
  // With a lever arm the velocity would need the angular rate, which ground truth does not have.
  if (lever_arm) truth->has_velocity = false;
  for (StampedState& state : truth->states) {
    state.T_WB = state.T_WB * T_SB;
    if (lever_arm) state.v_WB.setZero();
    state.bias.gyro = T_SB.R.transpose() * state.bias.gyro;
    state.bias.accel = T_SB.R.transpose() * state.bias.accel;
  }
}

GroundTruth readGroundTruth(const fs::path& folder, const SE3& T_body_imu) {
  const fs::path file = folder / "data.csv";
  if (!fs::exists(file)) return {};
  GroundTruth truth = readGroundTruthCsv(file.string());
  const fs::path yaml = folder / "sensor.yaml";
  const SE3 T_body_truth = fs::exists(yaml) ? readPoseYaml(yaml.string()) : SE3();
  const SE3 T_SB = T_body_truth.inverse() * T_body_imu;
  if (!T_SB.matrix().isIdentity(1e-12)) moveToImu(T_SB, &truth);
  return truth;
}

/** Of the rows without a counterpart in the `other` camera. */
template <typename Row>
void noteUnpaired(const std::string& csv, const std::vector<Row>& rows,
                  const std::vector<size_t>& alone, const char* other, std::vector<TimeNs>* stamps,
                  std::vector<std::string>* warnings) {
  for (const size_t i : alone) stamps->push_back(rows[i].t);
  if (alone.empty()) return;
  const Row& first = rows[alone.front()];
  warnings->push_back(csv + ":" + std::to_string(first.line) + ": " + std::to_string(alone.size()) +
                      (alone.size() == 1 ? " image has" : " images have") +
                      " no counterpart of the same stamp in " + other + " (first: stamp " +
                      std::to_string(first.t) + ")");
}

void append(std::vector<std::string>* all, const std::vector<std::string>& more) {
  all->insert(all->end(), more.begin(), more.end());
}

}  // namespace

bool EurocReader::accepts(const std::string& path) {
  std::error_code error;
  for (const char* folder : {"mav0", "cam0", "cam1", "imu0"})
    if (fs::is_directory(fs::path(path) / folder, error)) return true;
  return false;
}

EurocReader::EurocReader(const std::string& path, const RecordingOptions& options)
    : root_(path), options_(options) {
  refuseTopicOptions(options, path, "a folder of images");
  if (fs::is_directory(root_ / "mav0")) root_ /= "mav0";
  for (const char* sensor : {"cam0", "cam1", "imu0"})
    if (!fs::is_directory(root_ / sensor))
      throw DataError(root_.string(), 0,
                      std::string("there is no folder '") + sensor +
                          "'; expected a EuRoC (ASL) folder with cam0, cam1 and imu0");
}

std::vector<EurocReader::ImageRow> EurocReader::readImageList(const std::string& camera) const {
  const fs::path folder = root_ / camera;
  CsvReader csv((folder / "data.csv").string(), "2 columns (stamp [ns], file name)");
  std::vector<ImageRow> rows;
  while (csv.next({2})) {
    if (csv.text(1).empty()) csv.fail("expected a file name in column 2");
    rows.push_back(
        {csv.stamp(), (folder / "data" / std::string(csv.text(1))).string(), csv.line()});
  }
  if (rows.empty())
    throw DataError((folder / "data.csv").string(), 0, "expected at least one image");
  return rows;
}

fs::path EurocReader::camchain() const {
  if (!options_.camchain.empty()) return options_.camchain;
  if (fs::exists(root_ / "camchain.yaml")) return root_ / "camchain.yaml";
  const fs::path tum_vi = root_.parent_path() / "dso/camchain.yaml";
  return !fs::exists(root_ / "cam0/sensor.yaml") && fs::exists(tum_vi) ? tum_vi : fs::path();
}

fs::path EurocReader::kalibrImu() const {
  if (!options_.imu_yaml.empty()) return options_.imu_yaml;
  const fs::path tum_vi = root_.parent_path() / "dso/imu_config.yaml";
  return !fs::exists(root_ / "imu0/sensor.yaml") && fs::exists(tum_vi) ? tum_vi : fs::path();
}

/** Pairs by stamps; the rest goes into the recording's unpaired lists. */
void EurocReader::pairImages(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right,
                             Recording* recording) {
  const StereoPairs found =
      pairByStamps(stampsOf(left), stampsOf(right), options_.pair_tolerance_s);
  if (found.pairs.empty())
    throw DataError(root_.string(), 0,
                    "no stereo pair was found; expected left and right images with equal stamps" +
                        adviseTolerance(stampsOf(left), stampsOf(right)));
  for (const auto& [l, r] : found.pairs) {
    pairs_.push_back({left[l].t, left[l].path, right[r].path});
    recording->image_stamps.push_back(left[l].t);
  }
  if (const std::string offset = describeOffset(found); !offset.empty())
    recording->warnings.push_back(root_.string() + ": " + offset);
  if (const std::string advice = adviseOnAlone(found, stampsOf(left), stampsOf(right));
      !advice.empty())
    recording->warnings.push_back(root_.string() + ": " + advice);
  noteUnpaired((root_ / "cam0/data.csv").string(), left, found.alone_left, "cam1",
               &recording->unpaired_left, &recording->warnings);
  noteUnpaired((root_ / "cam1/data.csv").string(), right, found.alone_right, "cam0",
               &recording->unpaired_right, &recording->warnings);
}

/** The cameras of Kalibr's camchain; image stamps are brought to the IMU's clock. */
void EurocReader::useCamchain(Recording* recording,
                              std::array<std::vector<ImageRow>, 2>* images) const {
  const std::string path = camchain().string();
  const KalibrCamchain chain = readKalibrCamchain(path);
  append(&recording->warnings, chain.warnings);
  const double shift_s = imageTimeShift(chain, path, &recording->warnings);
  for (size_t c = 0; c < 2; ++c) {
    recording->calibration.cameras[c] = {chain.models[c], chain.T_CI[c].inverse(),
                                         measuredRate((*images)[c])};
    shiftStamps(durationNs(shift_s), (root_ / ("cam" + std::to_string(c))).string(), &(*images)[c],
                &recording->warnings);
  }
}

SE3 EurocReader::readImu(Recording* recording) const {
  recording->imu = readImuCsv((root_ / "imu0/data.csv").string(), &recording->warnings);
  const double rate_hz = measuredRate(recording->imu);
  if (!kalibrImu().empty()) {
    const KalibrImu imu = readKalibrImu(kalibrImu().string());
    append(&recording->warnings, imu.warnings);
    recording->calibration.imu = {imu.noise, imu.rate_hz.value_or(rate_hz)};
    return {};
  }
  const ImuYaml imu = readImuYaml(calibrationFile("imu0"));
  append(&recording->warnings, imu.warnings);
  recording->calibration.imu = {imu.noise, imu.rate_hz.value_or(rate_hz)};
  return imu.T_BS;
}

Recording EurocReader::read() {
  Recording recording;
  const SE3 T_BS = readImu(&recording);
  std::array<std::vector<ImageRow>, 2> images;
  const bool has_camchain = !camchain().empty();
  for (size_t c = 0; c < 2; ++c) {
    const std::string name = "cam" + std::to_string(c);
    images[c] = readImageList(name);
    if (has_camchain) continue;
    const CameraYaml camera = readCameraYaml(calibrationFile(name));
    append(&recording.warnings, camera.warnings);
    recording.calibration.cameras[c] = {camera.model, T_BS.inverse() * camera.T_BS,
                                        camera.rate_hz.value_or(measuredRate(images[c]))};
  }
  if (has_camchain) useCamchain(&recording, &images);
  pairImages(images[0], images[1], &recording);
  const char* const truth = fs::exists(root_ / "mocap0") ? "mocap0" : "state_groundtruth_estimate0";
  if (options_.own_truth) recording.ground_truth = readGroundTruth(root_ / truth, T_BS);
  calibration_ = recording.calibration;
  return recording;
}

LoadedFrame EurocReader::load(size_t index, bool decode) {
  const Pair& pair = pairs_.at(index);
  return loadPair(pair.t, pair.left, pair.right, calibration_, decode);
}

std::pair<std::string, std::string> EurocReader::paths(size_t index) const {
  return {pairs_.at(index).left, pairs_.at(index).right};
}

std::vector<RecordingFile> EurocReader::files() const {
  std::vector<RecordingFile> files;
  for (const auto& entry :
       fs::recursive_directory_iterator(root_, fs::directory_options::follow_directory_symlink))
    if (entry.is_regular_file())
      files.push_back({entry.path().string(), entry.path().lexically_relative(root_).string()});
  std::sort(files.begin(), files.end(),
            [](const RecordingFile& a, const RecordingFile& b) { return a.name < b.name; });
  for (const fs::path& file : {camchain(), kalibrImu()})
    if (!file.empty() && file.parent_path() != root_) files.push_back({file.string(), ""});
  return files;
}

std::string EurocReader::calibrationFile(const std::string& sensor) const {
  const fs::path kalibr = sensor == "imu0" ? kalibrImu() : camchain();
  if (!kalibr.empty()) return kalibr.string();
  return (root_ / sensor / "sensor.yaml").string();
}

}  // namespace etalon
