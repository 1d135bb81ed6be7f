#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "etalon/core/printable.h"
#include "etalon/frontend/recording_inspection.h"
#include "options/recording_option.h"

namespace etalon::app {

namespace {

using Json = nlohmann::ordered_json;

struct InfoArguments {
  std::string source;
  bool json = false;
  RecordingOptions recording;
};

Json streamJson(const StreamSummary& stream) {
  Json json;
  json["count"] = stream.count;
  if (stream.count == 0) return json;
  json["first_ns"] = stream.first;
  json["last_ns"] = stream.last;
  json["duration_s"] = stream.duration_s;
  json["rate_hz"] = stream.rate_hz;
  json["longest_step_s"] = stream.longest_step_s;
  json["gaps"] = Json::array();
  for (const StreamSummary::Gap& gap : stream.gaps)
    json["gaps"].push_back({{"after_ns", gap.after}, {"length_s", gap.length_s}});
  return json;
}

Json cameraJson(const CameraCalibration& camera) {
  const CameraModel& m = camera.model;
  const auto keyOf = [](std::string key, const std::vector<std::string>& names) {
    for (const std::string& name : names) key += "_" + name;
    return key;
  };
  Json json;
  json["camera_model"] = m.kind()->camera_model;
  json["distortion_model"] = m.kind()->distortion.front();
  json["resolution"] = {m.width(), m.height()};
  json[keyOf("intrinsics", m.kind()->intrinsics)] = m.intrinsics();
  json[keyOf("distortion", m.kind()->coefficients)] = m.coefficients();
  const Eigen::Matrix4d T = camera.T_BC.matrix();
  json["T_BC"] = Json::array();
  for (int r = 0; r < 4; ++r) json["T_BC"].push_back({T(r, 0), T(r, 1), T(r, 2), T(r, 3)});
  json["rate_hz"] = camera.rate_hz;
  return json;
}

Json timeOffsetJson(const TimeOffsetEstimate& offset) {
  Json json;
  json["estimated"] = offset.estimated;
  json["clear"] = offset.clear;
  if (!offset.reason.empty()) json["reason"] = offset.reason;
  if (!offset.estimated) return json;
  json["offset_s"] = offset.offset_s;
  json["offset_sigma_s"] = offset.sigma_s;
  json["discernible"] = offset.discernible();
  json["correlation"] = offset.correlation;
  json["correlation_at_zero"] = offset.correlation_at_zero;
  json["correlation_as_given"] = offset.correlation_as_given;
  json["correlation_mirrored"] = offset.correlation_mirrored;
  json["runner_up"] = offset.runner_up;
  json["gyro_scale"] = offset.gyro_scale;
  json["image_pairs"] = offset.steps;
  return json;
}

Json toJson(const RecordingInspection& inspection) {
  const RecordingInfo& info = inspection.info;
  const ImuNoiseDensities& noise = info.calibration.imu.noise;
  Json json;
  json["source"] = info.name;
  json["kind"] = info.kind;
  json["stereo"] = streamJson(info.images);
  json["stereo"]["unpaired_left"] = info.unpaired_left;
  json["stereo"]["unpaired_right"] = info.unpaired_right;
  json["stereo"]["missing_images"] = info.missing_images;
  json["stereo"]["unusable_images"] = info.unusable_images;
  json["imu"] = streamJson(info.imu);
  json["imu"]["mean_accel_norm"] = info.mean_accel_norm;
  json["ground_truth"] = streamJson(info.ground_truth);
  json["ground_truth"]["has_velocity"] = info.ground_truth_velocity;
  json["ground_truth"]["has_biases"] = info.ground_truth_biases;
  json["calibration"]["cameras"] = {cameraJson(info.calibration.cameras[0]),
                                    cameraJson(info.calibration.cameras[1])};
  json["calibration"]["baseline_m"] = info.calibration.baseline();
  json["calibration"]["imu"] = {{"rate_hz", info.calibration.imu.rate_hz},
                                {"gyroscope_noise_density", noise.gyro_noise_density},
                                {"gyroscope_random_walk", noise.gyro_random_walk},
                                {"accelerometer_noise_density", noise.accel_noise_density},
                                {"accelerometer_random_walk", noise.accel_random_walk}};
  json["time_offset"] = timeOffsetJson(inspection.time_offset);
  if (inspection.rotation_disagreement_deg)
    json["time_offset"]["R_BC0_disagreement_deg"] = *inspection.rotation_disagreement_deg;
  json["errors"] = info.errors;
  json["warnings"] = info.warnings;
  return json;
}

void printStream(const char* name, const StreamSummary& stream) {
  if (stream.count == 0) {
    std::printf("%-14s none\n", name);
    return;
  }
  std::printf("%-14s %zu, %.2f Hz, %.3f s, from %lld to %lld ns; longest step %.4f s, %zu %s\n",
              name, stream.count, stream.rate_hz, stream.duration_s,
              static_cast<long long>(stream.first), static_cast<long long>(stream.last),
              stream.longest_step_s, stream.gaps.size(), stream.gaps.size() == 1 ? "gap" : "gaps");
  constexpr size_t kPrinted = 5;
  for (size_t i = 0; i < std::min(kPrinted, stream.gaps.size()); ++i)
    std::printf("%-14s   gap of %.4f s after %lld\n", "", stream.gaps[i].length_s,
                static_cast<long long>(stream.gaps[i].after));
}

void printCamera(size_t index, const CameraCalibration& camera) {
  const CameraModel& m = camera.model;
  std::printf("camera %zu       %dx%d px,", index, m.width(), m.height());
  for (size_t i = 0; i < m.intrinsics().size(); ++i)
    std::printf(" %s %.3f", m.kind()->intrinsics[i].c_str(), m.intrinsics()[i]);
  std::printf(", %s", m.kind()->distortion.front().c_str());
  for (size_t i = 0; i < m.coefficients().size(); ++i)
    std::printf(" %s %g", m.kind()->coefficients[i].c_str(), m.coefficients()[i]);
  std::printf(", %g Hz\n", camera.rate_hz);
  for (int r = 0; r < 3; ++r)
    std::printf("%-14s %s % .6f % .6f % .6f % .6f\n", "", r == 0 ? "T_BC" : "    ",
                camera.T_BC.R(r, 0), camera.T_BC.R(r, 1), camera.T_BC.R(r, 2), camera.T_BC.t[r]);
}

void printTimeOffset(const TimeOffsetEstimate& offset) {
  if (!offset.estimated) {
    std::printf("time offset    not estimated: %s\n", offset.reason.c_str());
    return;
  }
  const char* judgement = offset.clear ? "; none is discernible" : "; not clear: ";
  std::printf(
      "time offset    gyro - camera %+.1f +- %.1f ms, correlation %.3f (%.3f without offset), from "
      "%d image pairs%s%s\n",
      1e3 * offset.offset_s, 1e3 * offset.sigma_s, offset.correlation, offset.correlation_at_zero,
      offset.steps, offset.discernible() ? "" : judgement, offset.reason.c_str());
}

void print(const RecordingInspection& inspection) {
  const RecordingInfo& info = inspection.info;
  std::printf("%s (%s)\n", info.name.c_str(), info.kind.c_str());
  printStream("stereo frames", info.images);
  if (info.unpaired_left + info.unpaired_right + info.missing_images + info.unusable_images > 0)
    std::printf("%-14s unpaired: %d left, %d right; pairs without files: %d, unusable: %d\n", "",
                info.unpaired_left, info.unpaired_right, info.missing_images, info.unusable_images);
  printStream("IMU samples", info.imu);
  std::printf("%-14s mean |acceleration| %.3f m/s^2\n", "", info.mean_accel_norm);
  printStream("ground truth", info.ground_truth);
  if (info.ground_truth.count > 0)
    std::printf("%-14s velocity: %s, biases: %s\n", "", info.ground_truth_velocity ? "yes" : "no",
                info.ground_truth_biases ? "yes" : "no");
  for (size_t c = 0; c < 2; ++c) printCamera(c, info.calibration.cameras[c]);
  std::printf("baseline       %.4f m\n", info.calibration.baseline());
  const ImuNoiseDensities& noise = info.calibration.imu.noise;
  std::printf(
      "IMU noise      gyro %.5g rad/s/sqrt(Hz), walk %.5g rad/s^2/sqrt(Hz); accelerometer "
      "%.5g m/s^2/sqrt(Hz), walk %.5g m/s^3/sqrt(Hz); %g Hz\n",
      noise.gyro_noise_density, noise.gyro_random_walk, noise.accel_noise_density,
      noise.accel_random_walk, info.calibration.imu.rate_hz);
  printTimeOffset(inspection.time_offset);
  if (inspection.rotation_disagreement_deg)
    std::printf("%-14s R_BC0 agrees with the motion to %.1f deg\n", "",
                *inspection.rotation_disagreement_deg);
  else if (inspection.time_offset.estimated)
    std::printf(
        "%-14s R_BC0 is not judged: the motion hardly turns about a second axis, or not as the "
        "images do\n",
        "");
  for (const std::string& error : info.errors) std::printf("error: %s\n", printable(error).c_str());
  if (info.warnings.empty() && info.errors.empty()) std::printf("warnings       none\n");
  for (const std::string& warning : info.warnings)
    std::printf("warning: %s\n", printable(warning).c_str());
}

}  // namespace

void addInfoCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand(
      "info", "Describe a recording: streams, gaps, calibration, noise model, what looks wrong.");
  command->add_option("SRC", arguments->source, kSourceFormats)->required();
  addRecordingOptions(command, &arguments->recording);
  command->add_flag("--json", arguments->json, "Print JSON.");
  command->footer(
      "Exit codes: 0 done, 2 usage, 3 the recording cannot be read, or no result of it can be "
      "right "
      "(error: ...).");
  command->callback([arguments, exit_code] {
    SourceOptions options;
    options.recording = arguments->recording;
    const auto source = openRecording(arguments->source, options);
    const RecordingInspection inspection = inspectRecording(*source);
    if (arguments->json)
      std::printf("%s\n",
                  toJson(inspection).dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    else
      print(inspection);
    *exit_code = inspection.info.errors.empty() ? kOk : kDataErrorExit;
  });
}

}  // namespace etalon::app
