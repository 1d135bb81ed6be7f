#include "etalon/datasets/euroc_source.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "calibration/kalibr_camchain.h"
#include "calibration/sensor_yaml.h"
#include "csv_reader.h"
#include "etalon/core/errors.h"
#include "path_frame_loader.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

struct ImageRow {
  TimeNs t = 0;
  std::string path;
  int line = 0;
};

std::vector<ImageRow> readImageList(const fs::path& camera_folder) {
  CsvReader csv((camera_folder / "data.csv").string(), "2 columns (stamp [ns], file name)");
  std::vector<ImageRow> rows;
  while (csv.next({2})) {
    if (csv.text(1).empty()) csv.fail("expected a file name in column 2");
    rows.push_back(
        {csv.stamp(), (camera_folder / "data" / std::string(csv.text(1))).string(), csv.line()});
  }
  if (rows.empty())
    throw DataError((camera_folder / "data.csv").string(), 0, "expected at least one image");
  return rows;
}

std::vector<ImuSample> readImu(const std::string& path) {
  CsvReader csv(path, "7 columns (stamp [ns], 3 x rate [rad/s], 3 x acceleration [m/s^2])");
  std::vector<ImuSample> samples;
  while (csv.next({7})) {
    ImuSample sample;
    sample.t = csv.stamp();
    for (int i = 0; i < 3; ++i) {
      sample.gyro[i] = csv.number(1 + i);
      sample.accel[i] = csv.number(4 + i);
    }
    samples.push_back(sample);
  }
  if (samples.size() < 2) throw DataError(path, 0, "expected at least two IMU samples");
  return samples;
}

/** Row of ground truth: sensor frame S of the ground truth in W; quaternion w, x, y, z. */
GroundTruthState parseState(const CsvReader& csv) {
  const auto vector = [&](size_t first) {
    return Eigen::Vector3d(csv.number(first), csv.number(first + 1), csv.number(first + 2));
  };
  GroundTruthState state;
  state.t = csv.stamp();
  const Eigen::Quaterniond q(csv.number(4), csv.number(5), csv.number(6), csv.number(7));
  if (std::abs(q.norm() - 1.0) > 1e-2)
    csv.fail("expected a unit quaternion (w, x, y, z) in columns 5 to 8, found norm " +
             std::to_string(q.norm()));
  state.T_WB = SE3(q.normalized().toRotationMatrix(), vector(1));
  if (csv.size() == 17) {
    state.v_WB = vector(8);
    state.b_g = vector(11);
    state.b_a = vector(14);
  }
  return state;
}

/** Brings states of the frame S to the IMU's frame B, T_SB known. */
void moveToImu(const SE3& T_SB, GroundTruth* truth) {
  const bool lever_arm = T_SB.t.norm() > 1e-9;
  // With a lever arm the velocity would need the angular rate, which ground truth does not have.
  if (lever_arm) truth->has_velocity = false;
  for (GroundTruthState& state : truth->states) {
    state.T_WB = state.T_WB * T_SB;
    if (lever_arm) state.v_WB.setZero();
    state.b_g = T_SB.R.transpose() * state.b_g;
    state.b_a = T_SB.R.transpose() * state.b_a;
  }
}

GroundTruth readGroundTruth(const fs::path& folder, const SE3& T_body_imu) {
  GroundTruth truth;
  const fs::path file = folder / "data.csv";
  if (!fs::exists(file)) return truth;
  CsvReader csv(file.string(),
                "17 columns (stamp [ns], position, quaternion w x y z, velocity, gyro bias, "
                "accelerometer bias) or 8 (stamp, position, quaternion)");
  std::vector<size_t> counts = {17, 8};
  while (csv.next(counts)) {
    counts = {csv.size()};
    truth.states.push_back(parseState(csv));
    truth.has_velocity = truth.has_biases = csv.size() == 17;
  }
  const fs::path yaml = folder / "sensor.yaml";
  const SE3 T_body_truth = fs::exists(yaml) ? readPoseYaml(yaml.string()) : SE3();
  const SE3 T_SB = T_body_truth.inverse() * T_body_imu;
  if (!T_SB.matrix().isIdentity(1e-12)) moveToImu(T_SB, &truth);
  return truth;
}

template <typename Row>
double measuredRate(const std::vector<Row>& rows) {
  if (rows.size() < 2) return 0;
  std::vector<TimeNs> steps;
  for (size_t i = 1; i < rows.size(); ++i) steps.push_back(rows[i].t - rows[i - 1].t);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                   steps.end());
  return 1.0 / (static_cast<double>(steps[steps.size() / 2]) * 1e-9);
}

class EurocFrameLoader : public FrameLoader {
 public:
  struct Pair {
    TimeNs t;
    std::string left, right;
  };
  EurocFrameLoader(std::vector<Pair> pairs, const StereoInertialCalibration& calibration)
      : pairs_(std::move(pairs)), calibration_(calibration) {}

  Result load(size_t index, bool decode) override {
    const Pair& pair = pairs_.at(index);
    return loadPair(pair.t, pair.left, pair.right, calibration_, decode);
  }
  std::pair<std::string, std::string> paths(size_t index) const override {
    return {pairs_.at(index).left, pairs_.at(index).right};
  }

 private:
  std::vector<Pair> pairs_;
  StereoInertialCalibration calibration_;
};

void warnUnpaired(const std::string& csv, const std::vector<ImageRow>& unpaired,
                  const std::string& other, std::vector<std::string>* warnings) {
  if (unpaired.empty()) return;
  warnings->push_back(csv + ":" + std::to_string(unpaired.front().line) + ": " +
                      std::to_string(unpaired.size()) +
                      (unpaired.size() == 1 ? " image has" : " images have") +
                      " no counterpart of the same stamp in " + other + " (first: stamp " +
                      std::to_string(unpaired.front().t) + ")");
}

/** Pairs by equal stamps; the rest goes into the recording's unpaired lists. */
std::vector<EurocFrameLoader::Pair> pairImages(const fs::path& root, Recording* recording,
                                               const std::vector<ImageRow>& left,
                                               const std::vector<ImageRow>& right) {
  std::vector<EurocFrameLoader::Pair> pairs;
  std::vector<ImageRow> alone_left, alone_right;
  size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    if (r == right.size() || (l < left.size() && left[l].t < right[r].t)) {
      alone_left.push_back(left[l++]);
    } else if (l == left.size() || right[r].t < left[l].t) {
      alone_right.push_back(right[r++]);
    } else {
      pairs.push_back({left[l].t, left[l].path, right[r].path});
      recording->image_stamps.push_back(left[l].t);
      ++l, ++r;
    }
  }
  for (const ImageRow& row : alone_left) recording->unpaired_left.push_back(row.t);
  for (const ImageRow& row : alone_right) recording->unpaired_right.push_back(row.t);
  warnUnpaired((root / "cam0/data.csv").string(), alone_left, "cam1", &recording->warnings);
  warnUnpaired((root / "cam1/data.csv").string(), alone_right, "cam0", &recording->warnings);
  return pairs;
}

void append(std::vector<std::string>* all, const std::vector<std::string>& more) {
  all->insert(all->end(), more.begin(), more.end());
}

/** The cameras of Kalibr's camchain; image stamps are brought to the IMU's clock. */
void useCamchain(const std::string& path, Recording* recording,
                 std::array<std::vector<ImageRow>, 2>* images) {
  const KalibrCamchain chain = readKalibrCamchain(path);
  append(&recording->warnings, chain.warnings);
  // One shift for both, so that pairs stay pairs.
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

fs::path rootOf(const std::string& path) {
  if (!fs::is_directory(path))
    throw DataError(path, 0, "there is no such folder; expected a EuRoC (ASL) folder");
  fs::path root =
      fs::is_directory(fs::path(path) / "mav0") ? fs::path(path) / "mav0" : fs::path(path);
  for (const char* sensor : {"cam0", "cam1", "imu0"})
    if (!fs::is_directory(root / sensor))
      throw DataError(root.string(), 0,
                      std::string("there is no folder '") + sensor +
                          "'; expected a EuRoC (ASL) folder with cam0, cam1 and imu0");
  return root;
}

}  // namespace

std::unique_ptr<RecordedSource> openEuroc(const std::string& path, const SourceOptions& options) {
  const fs::path root = rootOf(path);
  Recording recording;
  recording.name = path;
  recording.kind = "euroc";

  const ImuYaml imu = readImuYaml((root / "imu0/sensor.yaml").string());
  append(&recording.warnings, imu.warnings);
  recording.imu = readImu((root / "imu0/data.csv").string());
  recording.calibration.imu = {imu.noise, imu.rate_hz.value_or(measuredRate(recording.imu))};

  std::array<std::vector<ImageRow>, 2> images;
  for (size_t c = 0; c < 2; ++c) images[c] = readImageList(root / ("cam" + std::to_string(c)));
  if (const fs::path camchain = root / "camchain.yaml"; fs::exists(camchain)) {
    useCamchain(camchain.string(), &recording, &images);
  } else {
    for (size_t c = 0; c < 2; ++c) {
      const CameraYaml camera =
          readCameraYaml((root / ("cam" + std::to_string(c)) / "sensor.yaml").string());
      append(&recording.warnings, camera.warnings);
      recording.calibration.cameras[c] = {camera.model, imu.T_BS.inverse() * camera.T_BS,
                                          camera.rate_hz.value_or(measuredRate(images[c]))};
    }
  }
  std::vector<EurocFrameLoader::Pair> pairs = pairImages(root, &recording, images[0], images[1]);
  recording.ground_truth = readGroundTruth(root / "state_groundtruth_estimate0", imu.T_BS);
  auto loader = std::make_unique<EurocFrameLoader>(std::move(pairs), recording.calibration);
  return std::make_unique<RecordedSource>(std::move(recording), std::move(loader), options);
}

}  // namespace etalon
