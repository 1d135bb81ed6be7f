#pragma once

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/windows.h"
#include "etalon/runlog/json_members.h"

namespace etalon {

// The parts that the JSON of benchmarks and trials share.

/** @throws DataError unless the document says that it is of this format and version */
inline void checkFormat(const JsonReader& json, const char* format, int version) {
  if (!json.has("format") || json.at("format").text() != format)
    json.fail(std::string("expected \"format\": \"") + format + "\"");
  if (json.at("version").integer() != version)
    json.at("version").fail("expected version " + std::to_string(version));
}

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
void members(Archive& json, Member<Archive, BenchmarkInitializer>& initializer) {
  json("name", initializer.name);
  json("version", initializer.version);
  json("description", initializer.description);
  json("binary", initializer.binary);
  json("config", initializer.config);
}

template <typename Archive>
void members(Archive& json, Member<Archive, SuiteRecord>& record) {
  json("versions", record.versions);
  json("binaries", record.binaries);
  json("shard", record.shard);
  json("shards", record.shards);
  json("initializers", record.initializers);
  json("sequences", record.sequences);
  json("config", record.config);
}

}  // namespace etalon
