#include "euroc_reader.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "calibration/kalibr_camchain.h"
#include "calibration/sensor_yaml.h"
#include "csv_reader.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/datasets/euroc_files.h"
#include "image_file.h"

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

/** One over the median step, Hz; 0 of a single row. */
template <typename Row>
double measuredRate(const std::vector<Row>& rows) {
  std::vector<double> steps_ns;
  for (size_t i = 1; i < rows.size(); ++i)
    steps_ns.push_back(static_cast<double>(rows[i].t - rows[i - 1].t));
  return steps_ns.empty() ? 0.0 : 1.0 / (median(std::move(steps_ns)) * 1e-9);
}

/** Of the rows without a counterpart in the `other` camera. */
template <typename Row>
void noteUnpaired(const std::string& csv, const std::vector<Row>& unpaired, const char* other,
                  std::vector<TimeNs>* stamps, std::vector<std::string>* warnings) {
  for (const Row& row : unpaired) stamps->push_back(row.t);
  if (unpaired.empty()) return;
  warnings->push_back(csv + ":" + std::to_string(unpaired.front().line) + ": " +
                      std::to_string(unpaired.size()) +
                      (unpaired.size() == 1 ? " image has" : " images have") +
                      " no counterpart of the same stamp in " + other + " (first: stamp " +
                      std::to_string(unpaired.front().t) + ")");
}

void append(std::vector<std::string>* all, const std::vector<std::string>& more) {
  all->insert(all->end(), more.begin(), more.end());
}

}  // namespace

bool EurocReader::accepts(const std::string& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

EurocReader::EurocReader(const std::string& path) : root_(path) {
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

/** Pairs by equal stamps; the rest goes into the recording's unpaired lists. */
void EurocReader::pairImages(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right,
                             Recording* recording) {
  std::vector<ImageRow> alone_left, alone_right;
  size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    if (r == right.size() || (l < left.size() && left[l].t < right[r].t)) {
      alone_left.push_back(left[l++]);
    } else if (l == left.size() || right[r].t < left[l].t) {
      alone_right.push_back(right[r++]);
    } else {
      pairs_.push_back({left[l].t, left[l].path, right[r].path});
      recording->image_stamps.push_back(left[l].t);
      ++l, ++r;
    }
  }
  noteUnpaired((root_ / "cam0/data.csv").string(), alone_left, "cam1", &recording->unpaired_left,
               &recording->warnings);
  noteUnpaired((root_ / "cam1/data.csv").string(), alone_right, "cam0", &recording->unpaired_right,
               &recording->warnings);
}

/** The cameras of Kalibr's camchain; image stamps are brought to the IMU's clock. */
void EurocReader::useCamchain(Recording* recording,
                              std::array<std::vector<ImageRow>, 2>* images) const {
  const std::string path = camchain().string();
  const KalibrCamchain chain = readKalibrCamchain(path);
  append(&recording->warnings, chain.warnings);
  // Both cameras are shifted alike, so that pairs stay pairs.
  const auto [shift_s, other_s] = chain.timeshift_s;
  constexpr double kSameShift = 5e-4;  // s
  if (std::abs(shift_s - other_s) > kSameShift)
    recording->warnings.push_back(path + ": timeshift_cam_imu of cam0 and cam1 differ by " +
                                  std::to_string(1e3 * std::abs(shift_s - other_s)) +
                                  " ms; that of cam0 is used for both");
  if (shift_s != 0.0) {
    std::ostringstream shift_ms;
    shift_ms << 1e3 * shift_s;
    recording->warnings.push_back(path + ": image stamps are moved by " + shift_ms.str() +
                                  " ms to the IMU's clock (timeshift_cam_imu)");
  }
  for (size_t c = 0; c < 2; ++c) {
    recording->calibration.cameras[c] = {chain.models[c], chain.T_CI[c].inverse(),
                                         measuredRate((*images)[c])};
    for (ImageRow& row : (*images)[c]) row.t += durationNs(shift_s);
  }
}

Recording EurocReader::read() {
  Recording recording;
  const ImuYaml imu = readImuYaml(calibrationFile("imu0"));
  append(&recording.warnings, imu.warnings);
  recording.imu = readImuCsv((root_ / "imu0/data.csv").string());
  recording.calibration.imu = {imu.noise, imu.rate_hz.value_or(measuredRate(recording.imu))};

  std::array<std::vector<ImageRow>, 2> images;
  const bool has_camchain = fs::exists(camchain());
  for (size_t c = 0; c < 2; ++c) {
    const std::string name = "cam" + std::to_string(c);
    images[c] = readImageList(name);
    if (has_camchain) continue;
    const CameraYaml camera = readCameraYaml(calibrationFile(name));
    append(&recording.warnings, camera.warnings);
    recording.calibration.cameras[c] = {camera.model, imu.T_BS.inverse() * camera.T_BS,
                                        camera.rate_hz.value_or(measuredRate(images[c]))};
  }
  if (has_camchain) useCamchain(&recording, &images);
  pairImages(images[0], images[1], &recording);
  recording.ground_truth = readGroundTruth(root_ / "state_groundtruth_estimate0", imu.T_BS);
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
  return files;
}

std::string EurocReader::calibrationFile(const std::string& sensor) const {
  if (sensor != "imu0" && fs::exists(camchain())) return camchain().string();
  return (root_ / sensor / "sensor.yaml").string();
}

}  // namespace etalon
