#include "record_json.h"

#include <cmath>
#include <cstdio>

#include "etalon/benchmark/windows.h"
#include "etalon/runlog/attempt_json.h"

namespace etalon {
namespace {

using Json = nlohmann::ordered_json;

Json biasJson(const ImuBias& bias) {
  return {{"gyro_rps", vectorJson(bias.gyro)}, {"accel_mps2", vectorJson(bias.accel)}};
}

ImuBias biasFromJson(const JsonReader& json) {
  return {json.at("gyro_rps").vector<3>(), json.at("accel_mps2").vector<3>()};
}

Json boundJson(const GroundTruthBound& bound) {
  Json json;
  json["interval_s"] = numberJson(bound.interval_s);
  json["rre_deg"] = numberJson(bound.rre_deg);
  json["bias"] = biasJson(bound.bias);
  json["gravity_direction_G"] = vectorJson(bound.gravity_direction_G);
  json["world_tilt_deg"] = numberJson(bound.world_tilt_deg);
  return json;
}

GroundTruthBound boundFromJson(const JsonReader& json) {
  GroundTruthBound bound;
  bound.interval_s = json.at("interval_s").number();
  bound.rre_deg = json.at("rre_deg").number();
  bound.bias = biasFromJson(json.at("bias"));
  bound.gravity_direction_G = json.at("gravity_direction_G").vector<3>();
  bound.world_tilt_deg = json.at("world_tilt_deg").number();
  return bound;
}

Json sequenceJson(const BenchmarkSequence& s) {
  Json json;
  json["name"] = s.name;
  json["source"] = s.source;
  json["source_kind"] = s.source_kind;
  json["content"] = s.content;
  json["first_image_ns"] = s.first_image;
  json["last_image_ns"] = s.last_image;
  json["duration_s"] = numberJson(s.duration_s);
  json["stereo_frames"] = s.stereo_frames;
  json["unreadable_images"] = s.unreadable_images;
  json["has_ground_truth"] = s.has_ground_truth;
  json["warnings"] = s.warnings;
  json["floor"] = boundJson(s.bound);
  json["gyro_agreement"] = {{"median", numberJson(s.gyro_agreement.median)},
                            {"rms", numberJson(s.gyro_agreement.rms)}};
  json["frontend_ms"] = numberJson(s.frontend_ms);
  json["error"] = s.error;
  return json;
}

BenchmarkSequence sequenceFromJson(const JsonReader& json) {
  BenchmarkSequence s;
  s.name = json.at("name").text();
  if (s.name.find('/') != std::string::npos)  // it names a file in slots/
    json.at("name").fail("expected a name without '/'");
  s.source = json.at("source").text();
  s.source_kind = json.at("source_kind").text();
  s.content = json.at("content").text();
  s.first_image = json.at("first_image_ns").stamp();
  s.last_image = json.at("last_image_ns").stamp();
  if (secondsBetween(s.first_image, s.last_image) > kLongestRecordingS)
    json.at("last_image_ns").fail("expected images that are at most 7 days apart");
  s.duration_s = json.at("duration_s").number();
  s.stereo_frames = json.at("stereo_frames").count();
  s.unreadable_images = json.at("unreadable_images").count();
  s.has_ground_truth = json.at("has_ground_truth").boolean();
  for (const JsonReader& warning : json.at("warnings").elements())
    s.warnings.push_back(warning.text());
  s.bound = boundFromJson(json.at("floor"));
  if (json.has("gyro_agreement"))
    s.gyro_agreement = {json.at("gyro_agreement").at("median").number(),
                        json.at("gyro_agreement").at("rms").number()};
  s.frontend_ms = json.at("frontend_ms").number();
  s.error = json.at("error").text();
  return s;
}

Json truthJson(const GroundTruthState& state) {
  Json json = stateJson({state.t, state.T_WB, state.v_WB});
  json["b_g_rps"] = vectorJson(state.b_g);
  json["b_a_mps2"] = vectorJson(state.b_a);
  return json;
}

GroundTruthState truthFromJson(const JsonReader& json) {
  const KeyframeState state = stateFromJson(json);
  GroundTruthState truth;
  truth.t = state.t;
  truth.T_WB = state.T_WB;
  truth.v_WB = state.v_WB;
  truth.b_g = json.at("b_g_rps").vector<3>();
  truth.b_a = json.at("b_a_mps2").vector<3>();
  return truth;
}

Json groupJson(const ResidualGroup& group) {
  return {{"chi2", numberJson(group.chi2)}, {"dof", numberJson(group.dof)}};
}

ResidualGroup groupFromJson(const JsonReader& json) {
  return {json.at("chi2").number(), json.at("dof").number()};
}

Json noiseJson(const NoiseCheck& noise) {
  Json json;
  json["gyro"] = groupJson(noise.gyro);
  json["accel"] = groupJson(noise.accel);
  json["vision"] = groupJson(noise.vision);
  json["coupling"] = Json::array();
  for (int row = 0; row < 3; ++row)
    json["coupling"].push_back(vectorJson(Eigen::Vector3d(noise.coupling.row(row))));
  return json;
}

NoiseCheck noiseFromJson(const JsonReader& json) {
  NoiseCheck noise;
  noise.gyro = groupFromJson(json.at("gyro"));
  noise.accel = groupFromJson(json.at("accel"));
  noise.vision = groupFromJson(json.at("vision"));
  const std::vector<JsonReader> rows = json.at("coupling").elements();
  if (rows.size() != 3) json.at("coupling").fail("expected three rows");
  for (int row = 0; row < 3; ++row)
    noise.coupling.row(row) = rows[static_cast<size_t>(row)].vector<3>();
  return noise;
}

/** A number in the range that `etalon bench` takes. */
double between(const JsonReader& json, double least, double most) {
  const double value = json.number();
  if (!(least <= value && value <= most)) {
    char expected[80];
    std::snprintf(expected, sizeof expected, "expected a number from %g to %g", least, most);
    json.fail(expected);
  }
  return value;
}

BenchmarkProtocol protocolFromJson(const JsonReader& json) {
  BenchmarkProtocol protocol;
  protocol.every_s = between(json.at("every_s"), 0.01, 1e6);
  protocol.keyframes.clear();
  for (const JsonReader& n : json.at("keyframes").elements()) {
    between(n, 2, 200);
    protocol.keyframes.push_back(n.count());
  }
  protocol.rates_hz.clear();
  for (const JsonReader& rate : json.at("rates_hz").elements())
    protocol.rates_hz.push_back(between(rate, 0.1, 100));
  protocol.vi_ba = json.at("vi_ba").boolean();
  return protocol;
}

}  // namespace

Json benchmarkHeadJson(const BenchmarkRecord& record) {
  Json json;
  json["format"] = kBenchmarkFormat;
  json["version"] = kBenchmarkFormatVersion;
  json["protocol"]["every_s"] = record.protocol.every_s;
  json["protocol"]["keyframes"] = record.protocol.keyframes;
  json["protocol"]["rates_hz"] = record.protocol.rates_hz;
  json["protocol"]["vi_ba"] = record.protocol.vi_ba;
  json["versions"] = Json::object();
  for (const auto& [name, version] : record.versions) json["versions"][name] = version;
  json["binaries"] = record.binaries;
  json["shard"] = record.shard;
  json["shards"] = record.shards;
  json["initializers"] = Json::array();
  for (const BenchmarkInitializer& initializer : record.initializers)
    json["initializers"].push_back({{"name", initializer.name},
                                    {"version", initializer.version},
                                    {"description", initializer.description},
                                    {"binary", initializer.binary},
                                    {"config", initializer.config}});
  json["sequences"] = Json::array();
  for (const BenchmarkSequence& sequence : record.sequences)
    json["sequences"].push_back(sequenceJson(sequence));
  json["config"] = record.config;
  return json;
}

BenchmarkRecord benchmarkHeadFromJson(const JsonReader& json) {
  if (!json.has("format") || json.at("format").text() != kBenchmarkFormat)
    json.fail(std::string("expected \"format\": \"") + kBenchmarkFormat + "\"");
  if (json.at("version").integer() != kBenchmarkFormatVersion)
    json.at("version").fail("expected version " + std::to_string(kBenchmarkFormatVersion));
  BenchmarkRecord record;
  record.protocol = protocolFromJson(json.at("protocol"));
  const JsonReader versions = json.at("versions");
  for (const std::string& name : versions.keys()) record.versions[name] = versions.at(name).text();
  record.binaries = json.at("binaries").text();
  record.shard = json.at("shard").count();
  record.shards = json.at("shards").count();
  for (const JsonReader& initializer : json.at("initializers").elements())
    record.initializers.push_back({initializer.at("name").text(), initializer.at("version").text(),
                                   initializer.at("description").text(),
                                   initializer.at("binary").text(),
                                   initializer.at("config").text()});
  for (const JsonReader& sequence : json.at("sequences").elements())
    record.sequences.push_back(sequenceFromJson(sequence));
  record.config = json.at("config").text();
  return record;
}

Json resultJson(const WindowResult& result) {
  Json json;
  json["sequence"] = result.sequence;
  json["segment"] = result.window;
  json["t0_ns"] = result.t0;
  json["keyframes"] = result.keyframes;
  json["rate_hz"] = result.rate_hz;
  json["initializer"] = result.initializer;
  json["attempt"] = attemptJson(result.attempt);
  json["truth"] = Json::array();
  for (const GroundTruthState& state : result.truth) json["truth"].push_back(truthJson(state));
  const GyroWindowBound& bound = result.gyro_bound;
  if (!std::isnan(bound.rre_deg)) json["gyro_rre_deg"] = bound.rre_deg;
  if (!std::isnan(bound.gyro_bias_rps)) json["gyro_bias_floor_rps"] = bound.gyro_bias_rps;
  if (result.noise) json["noise"] = noiseJson(*result.noise);
  return json;
}

WindowResult resultFromJson(const JsonReader& json) {
  WindowResult result;
  result.sequence = json.at("sequence").text();
  result.window = json.at("segment").count();
  result.t0 = json.at("t0_ns").stamp();
  result.keyframes = json.at("keyframes").count();
  result.rate_hz = json.at("rate_hz").number();
  result.initializer = json.at("initializer").text();
  result.attempt = attemptFromJson(json.at("attempt"));
  for (const JsonReader& state : json.at("truth").elements())
    result.truth.push_back(truthFromJson(state));
  if (json.has("gyro_rre_deg")) result.gyro_bound.rre_deg = json.at("gyro_rre_deg").number();
  if (json.has("gyro_bias_floor_rps"))
    result.gyro_bound.gyro_bias_rps = json.at("gyro_bias_floor_rps").number();
  if (json.has("noise")) result.noise = noiseFromJson(json.at("noise"));
  return result;
}

}  // namespace etalon
