#include "record_json.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "etalon/core/text.h"
#include "etalon/runlog/attempt_json.h"
#include "suite/suite_json.h"

namespace etalon {

using Json = nlohmann::ordered_json;

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
  json.added("min_coverage", protocol.min_coverage);
}

/** All members but the results. */
template <typename Archive>
void members(Archive& json, Member<Archive, BenchmarkRecord>& record) {
  json("protocol", record.protocol);
  members<Archive>(json, static_cast<Member<Archive, SuiteRecord>&>(record));
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
  json.unlessNone("gyro_rre_bound_deg", result.truth_check.rre_deg);
  json.unlessNone("gyro_bias_bound_rps", result.truth_check.gyro_bias_rps);
  json.unlessNone("velocity_step_mps", result.truth_check.velocity_step_mps);
  json("noise", result.noise);
}

Json benchmarkHeadJson(const BenchmarkRecord& record) {
  Json json = {{"format", kBenchmarkFormat}, {"version", kBenchmarkFormatVersion}};
  json.update(asJson(record));
  return json;
}

BenchmarkRecord benchmarkHeadFromJson(const JsonReader& json) {
  checkFormat(json, kBenchmarkFormat, kBenchmarkFormatVersion);
  return fromJson<BenchmarkRecord>(json);
}

Json resultJson(const WindowResult& result) { return asJson(result); }

WindowResult resultFromJson(const JsonReader& json) { return fromJson<WindowResult>(json); }

}  // namespace etalon
