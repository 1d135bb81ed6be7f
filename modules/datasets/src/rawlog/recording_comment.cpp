#include "etalon/datasets/recording_comment.h"

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"

namespace etalon {

namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

/** "intrinsics_fu_fv_cu_cv". */
std::string keyOf(std::string key, const std::vector<std::string>& names) {
  for (const std::string& name : names) key += "_" + name;
  return key;
}

OrderedJson cameraJson(const CameraCalibration& camera) {
  const CameraModel& m = camera.model;
  const CameraKind& kind = *m.kind();
  const Eigen::Matrix4d T = camera.T_BC.matrix();
  OrderedJson json;
  json["camera_model"] = kind.camera_model;
  json["resolution"] = {m.width(), m.height()};
  json[keyOf("intrinsics", kind.intrinsics)] = m.intrinsics();
  json["distortion_model"] = kind.distortion.front();
  json[keyOf("distortion", kind.coefficients)] = m.coefficients();
  OrderedJson rows = OrderedJson::array();
  for (int r = 0; r < 4; ++r) rows.push_back({T(r, 0), T(r, 1), T(r, 2), T(r, 3)});
  json["T_BC"] = rows;
  json["rate_hz"] = camera.rate_hz;
  return json;
}

/** `json` as a whole number, one beyond the type as the largest; nlohmann's get() would cut any number
 * down to one. */
std::int64_t wholeNumber(const Json& json) {
  constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
  if (!json.is_number_integer()) throw std::runtime_error("expected a whole number");
  if (json.is_number_unsigned() && json.get<std::uint64_t>() > std::uint64_t{kLargest})
    return kLargest;
  return json.get<std::int64_t>();
}

int pixels(const Json& json) {
  const std::int64_t value = wholeNumber(json);
  if (value < 1 || value > 100'000) throw std::runtime_error("expected 1 to 100000 pixels");
  return static_cast<int>(value);
}

/** @param name "cam0" or "cam1" */
CameraCalibration cameraFromJson(const Json& json, const std::string& name) {
  CameraCalibration camera;
  const std::string model = json.at("camera_model"), distortion = json.at("distortion_model");
  const CameraKind* kind = findCameraKind(model, distortion);
  if (!kind) throw std::runtime_error("supported is " + describeCameraKinds());
  try {
    camera.model = CameraModel(
        model, distortion, pixels(json.at("resolution").at(0)), pixels(json.at("resolution").at(1)),
        json.at(keyOf("intrinsics", kind->intrinsics)).get<std::vector<double>>(),
        json.at(keyOf("distortion", kind->coefficients)).get<std::vector<double>>());
  } catch (const ConfigError& e) {
    throw std::runtime_error(e.what() + (" of " + name));
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) camera.T_BC.R(r, c) = json.at("T_BC").at(r).at(c);
    camera.T_BC.t[r] = json.at("T_BC").at(r).at(3);
  }
  camera.rate_hz = json.at("rate_hz");
  return camera;
}

/** First stamp, then differences: a third of the digits. */
Json stampsJson(const std::vector<TimeNs>& stamps) {
  Json json = Json::array();
  TimeNs last = 0;
  for (const TimeNs t : stamps) {
    json.push_back(t - last);
    last = t;
  }
  return json;
}

std::vector<TimeNs> stampsFromJson(const Json& json) {
  std::vector<TimeNs> stamps;
  TimeNs t = 0;
  for (const Json& element : json) {
    const std::int64_t difference = wholeNumber(element);
    if (difference < -kLastStamp || difference > kLastStamp || !isStamp(t + difference))
      throw std::runtime_error("expected stamps in ns from 0 to " + std::to_string(kLastStamp));
    stamps.push_back(t += difference);
  }
  return stamps;
}

void append(Json* row, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) row->push_back(v[i]);
}

Eigen::Vector3d vectorAt(const Json& row, size_t first) {
  return {row.at(first).get<double>(), row.at(first + 1).get<double>(),
          row.at(first + 2).get<double>()};
}

/** Parses, checks the version, and turns what goes wrong into a DataError. */
template <typename Read>
auto parsed(const std::string& text, const std::string& label, const std::string& log, Read read) {
  try {
    const Json json = Json::parse(text);
    const std::int64_t version = wholeNumber(json.at("version"));
    if (version != kRecordingFormatVersion)
      throw std::runtime_error("expected version " + std::to_string(kRecordingFormatVersion) +
                               ", found " + std::to_string(version));
    return read(json);
  } catch (const std::exception& e) {
    throw DataError(log, 0, "the comment '" + label + "' cannot be used: " + e.what());
  }
}

}  // namespace

std::string toJson(const RecordingComment& comment) {
  const ImuNoiseDensities& noise = comment.calibration.imu.noise;
  OrderedJson json;
  json["format"] = kRecordingFormat;
  json["version"] = kRecordingFormatVersion;
  json["provenance"] = {{"source", comment.source}, {"kind", comment.source_kind}};
  json["images_embedded"] = comment.images_embedded;
  json["sensor_labels"] = {{"stereo", comment.stereo_label},
                           {"imu", comment.imu_label},
                           {"ground_truth", comment.ground_truth_label}};
  OrderedJson& imu = json["calibration"]["imu"];
  imu["rate_hz"] = comment.calibration.imu.rate_hz;
  imu["gyroscope_noise_density"] = noise.gyro_noise_density;
  imu["gyroscope_random_walk"] = noise.gyro_random_walk;
  imu["accelerometer_noise_density"] = noise.accel_noise_density;
  imu["accelerometer_random_walk"] = noise.accel_random_walk;
  json["calibration"]["cameras"] = {cameraJson(comment.calibration.cameras[0]),
                                    cameraJson(comment.calibration.cameras[1])};
  // The source's path may be no UTF-8.
  return json.dump(1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string toJson(const RecordingIndex& index) {
  OrderedJson json;
  json["format"] = kIndexFormat;
  json["version"] = kRecordingFormatVersion;
  json["stamps_ns"] = {{"images", stampsJson(index.image_stamps)},
                       {"imu", stampsJson(index.imu_stamps)}};
  const GroundTruth& truth = index.ground_truth;
  if (!truth.empty()) {
    std::vector<TimeNs> stamps;
    Json rows = Json::array();
    for (const StampedState& state : truth.states) {
      stamps.push_back(state.t);
      Json row = Json::array();
      if (truth.has_velocity) append(&row, state.v_WB);
      if (truth.has_biases) {
        append(&row, state.bias.gyro);
        append(&row, state.bias.accel);
      }
      if (!row.empty()) rows.push_back(row);
    }
    json["stamps_ns"]["ground_truth"] = stampsJson(stamps);
    json["ground_truth"] = {{"has_velocity", truth.has_velocity},
                            {"has_biases", truth.has_biases},
                            {"v_WB_b_g_b_a", rows}};
  }
  return json.dump();
}

RecordingComment recordingCommentFromJson(const std::string& text, const std::string& log) {
  return parsed(text, kRecordingFormat, log, [](const Json& json) {
    RecordingComment comment;
    comment.source = json.at("provenance").at("source");
    comment.source_kind = json.at("provenance").at("kind");
    comment.images_embedded = json.at("images_embedded");
    comment.stereo_label = json.at("sensor_labels").at("stereo");
    comment.imu_label = json.at("sensor_labels").at("imu");
    comment.ground_truth_label = json.at("sensor_labels").at("ground_truth");
    const Json& calibration = json.at("calibration");
    for (size_t c = 0; c < 2; ++c)
      comment.calibration.cameras[c] =
          cameraFromJson(calibration.at("cameras").at(c), "cam" + std::to_string(c));
    const Json& imu = calibration.at("imu");
    comment.calibration.imu.rate_hz = imu.at("rate_hz");
    ImuNoiseDensities& noise = comment.calibration.imu.noise;
    noise.gyro_noise_density = imu.at("gyroscope_noise_density");
    noise.gyro_random_walk = imu.at("gyroscope_random_walk");
    noise.accel_noise_density = imu.at("accelerometer_noise_density");
    noise.accel_random_walk = imu.at("accelerometer_random_walk");
    return comment;
  });
}

RecordingIndex recordingIndexFromJson(const std::string& text, const std::string& log) {
  return parsed(text, kIndexFormat, log, [](const Json& json) {
    RecordingIndex index;
    index.image_stamps = stampsFromJson(json.at("stamps_ns").at("images"));
    index.imu_stamps = stampsFromJson(json.at("stamps_ns").at("imu"));
    if (!json.contains("ground_truth")) return index;
    GroundTruth& truth = index.ground_truth;
    const Json& rows = json.at("ground_truth").at("v_WB_b_g_b_a");
    truth.has_velocity = json.at("ground_truth").at("has_velocity");
    truth.has_biases = json.at("ground_truth").at("has_biases");
    for (const TimeNs t : stampsFromJson(json.at("stamps_ns").at("ground_truth"))) {
      StampedState state;
      state.t = t;
      const size_t i = truth.states.size();
      if (truth.has_velocity) state.v_WB = vectorAt(rows.at(i), 0);
      if (truth.has_biases) {
        state.bias.gyro = vectorAt(rows.at(i), truth.has_velocity ? 3 : 0);
        state.bias.accel = vectorAt(rows.at(i), truth.has_velocity ? 6 : 3);
      }
      truth.states.push_back(state);
    }
    return index;
  });
}

std::string formatOfComment(const std::string& text) {
  size_t at = 0;
  const auto expect = [&](const std::string& token) {
    at = text.find_first_not_of(" \t\r\n", at);
    if (at == std::string::npos || text.compare(at, token.size(), token) != 0) return false;
    at += token.size();
    return true;
  };
  if (!expect("{") || !expect("\"format\"") || !expect(":") || !expect("\"")) return {};
  const size_t end = text.find('"', at);
  return end == std::string::npos ? "" : text.substr(at, end - at);
}

mrpt::obs::CObservationComment commentObservation(TimeNs t, const std::string& text) {
  mrpt::obs::CObservationComment comment;
  comment.timestamp = toMrptTime(t);
  comment.text = text;
  return comment;
}

}  // namespace etalon
