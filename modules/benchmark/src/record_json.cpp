#include "record_json.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "etalon/benchmark/windows.h"
#include "etalon/core/text.h"
#include "etalon/runlog/attempt_json.h"

namespace etalon {

using Json = nlohmann::ordered_json;

template <typename Archive>
void members(Archive& json, Member<Archive, ImuBias>& bias) {
  json("gyro_rps", bias.gyro);
  json("accel_mps2", bias.accel);
}

template <typename Archive>
void members(Archive& json, Member<Archive, GroundTruthCheck>& check) {
  json("interval_s", check.interval_s);
  json("rre_deg", check.rre_deg);
  json("bias", check.bias);
  json("gravity_direction_G", check.gravity_direction_G);
  json("world_tilt_deg", check.world_tilt_deg);
}

template <typename Archive>
void members(Archive& json, Member<Archive, GyroAgreement>& agreement) {
  json("median", agreement.median);
  json("rms", agreement.rms);
}

template <typename Archive>
void members(Archive& json, Member<Archive, BenchmarkSequence>& s) {
  json("name", s.name);
  // The name becomes a file name in windows/.
  json.expect(
      "name", [&] { return s.name.find('/') == std::string::npos; }, "expected a name without '/'");
  json("source", s.source);
  json("source_kind", s.source_kind);
  json("content", s.content);
  json("first_image_ns", s.first_image);
  json("last_image_ns", s.last_image);
  json.expect(
      "last_image_ns",
      [&] { return secondsBetween(s.first_image, s.last_image) <= kLongestRecordingS; },
      "expected images that are at most 7 days apart");
  json("duration_s", s.duration_s);
  json("stereo_frames", s.stereo_frames);
  json("unreadable_images", s.unreadable_images);
  json("has_ground_truth", s.has_ground_truth);
  json("warnings", s.warnings);
  json("ground_truth_check", s.ground_truth_check);
  json.added("gyro_agreement", s.gyro_agreement);
  json("frontend_ms", s.frontend_ms);
  json("error", s.error);
}

template <typename Archive>
void members(Archive& json, Member<Archive, StampedState>& truth) {
  motionMembers(json, truth);
  json("b_g_rps", truth.bias.gyro);
  json("b_a_mps2", truth.bias.accel);
}

template <typename Archive>
void members(Archive& json, Member<Archive, ResidualGroup>& group) {
  json("chi2", group.chi2);
  json("dof", group.dof);
}

template <typename Archive>
void members(Archive& json, Member<Archive, NoiseCheck>& noise) {
  json("gyro", noise.gyro);
  json("accel", noise.accel);
  json("vision", noise.vision);
  json("coupling", noise.coupling);
}

template <typename Archive>
void members(Archive& json, Member<Archive, BenchmarkProtocol>& protocol) {
  // The limits are those of `etalon bench`.
  const auto limited = [&json](const char* key, const auto& numbers, double least, double most) {
    json.expect(
        key,
        [&] {
          return std::all_of(std::begin(numbers), std::end(numbers),
                             [=](double x) { return least <= x && x <= most; });
        },
        format("expected a number from %g to %g", least, most));
  };
  json("every_s", protocol.every_s);
  limited("every_s", std::array{protocol.every_s}, 0.01, 1e6);
  json("keyframes", protocol.keyframes);
  limited("keyframes", protocol.keyframes, 2, 200);
  json("rates_hz", protocol.rates_hz);
  limited("rates_hz", protocol.rates_hz, 0.1, 100);
  json("vi_ba", protocol.vi_ba);
  json.added("min_keyframes", protocol.min_keyframes);
}

template <typename Archive>
void members(Archive& json, Member<Archive, BenchmarkInitializer>& initializer) {
  json("name", initializer.name);
  json("version", initializer.version);
  json("description", initializer.description);
  json("binary", initializer.binary);
  json("config", initializer.config);
}

/** All members but the results. */
template <typename Archive>
void members(Archive& json, Member<Archive, BenchmarkRecord>& record) {
  json("protocol", record.protocol);
  json("versions", record.versions);
  json("binaries", record.binaries);
  json("shard", record.shard);
  json("shards", record.shards);
  json("initializers", record.initializers);
  json("sequences", record.sequences);
  json("config", record.config);
}

template <typename Archive>
void members(Archive& json, Member<Archive, WindowResult>& result) {
  json("sequence", result.sequence);
  json("window", result.window);
  json("t0_ns", result.t0);
  json("keyframes", result.keyframes);
  json("rate_hz", result.rate_hz);
  json("initializer", result.initializer);
  json("attempt", result.attempt);
  json("truth", result.truth);
  json.unlessNone("gyro_rre_bound_deg", result.gyro_bound.rre_deg);
  json.unlessNone("gyro_bias_bound_rps", result.gyro_bound.gyro_bias_rps);
  json("noise", result.noise);
}

Json benchmarkHeadJson(const BenchmarkRecord& record) {
  Json json = {{"format", kBenchmarkFormat}, {"version", kBenchmarkFormatVersion}};
  json.update(asJson(record));
  return json;
}

BenchmarkRecord benchmarkHeadFromJson(const JsonReader& json) {
  if (!json.has("format") || json.at("format").text() != kBenchmarkFormat)
    json.fail(std::string("expected \"format\": \"") + kBenchmarkFormat + "\"");
  if (json.at("version").integer() != kBenchmarkFormatVersion)
    json.at("version").fail("expected version " + std::to_string(kBenchmarkFormatVersion));
  return fromJson<BenchmarkRecord>(json);
}

Json resultJson(const WindowResult& result) { return asJson(result); }

WindowResult resultFromJson(const JsonReader& json) { return fromJson<WindowResult>(json); }

}  // namespace etalon
