#include "etalon/benchmark/trial/trial_record.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

std::string joinedFilled(const std::vector<std::string>& words, const std::string& between) {
  std::vector<std::string> filled;
  for (const std::string& word : words)
    if (!word.empty()) filled.push_back(word);
  return joined(filled, between);
}

/** A run of `seconds` may end between the last image and where the next one would be, s. */
constexpr double kTolerance = 0.1;

/** Whether a recording whose last image comes after `last_s` holds a run from `from_s`. */
bool fits(const TrialProtocol& protocol, double from_s, double last_s) {
  return from_s <= std::min(last_s - protocol.seconds + kTolerance, last_s - kTolerance);
}

void appendErrors(const TrialErrors& e, std::string* line) {
  for (const double value : {e.ate_m, e.ate_yaw_m, e.rotation_deg, e.rpe_m, e.rpe_deg})
    *line += "," + csvNumber(value);
}

}  // namespace

const std::vector<double>& timesAfterStart() {
  static const std::vector<double> times = {1.0, 5.0, 10.0, 0.0};
  return times;
}

std::vector<TrialVariant> variantsOf(const TrialRecord& record) {
  std::vector<TrialVariant> variants;
  for (const NamedText& setting : record.settings)
    for (const std::string& odometry : record.odometries)
      for (const BenchmarkInitializer& initializer : record.initializers)
        variants.push_back({"", setting.name, odometry, initializer.name});
  for (const NamedText& system : record.systems) variants.push_back({system.name, "", "", ""});
  return variants;
}

std::string labelOf(const TrialVariant& variant, const TrialRecord& record) {
  if (!variant.system.empty()) return variant.system;
  const bool several = record.odometries.size() > 1, all = record.settings.size() <= 1 && !several;
  std::string rest =
      joinedFilled({several ? variant.odometry : "",
                    all || record.initializers.size() > 1 ? variant.initializer : ""},
                   " ");
  if (record.settings.size() <= 1) return rest;
  return rest.empty() ? variant.setting : variant.setting + ": " + rest;
}

std::vector<double> startsOf(const TrialProtocol& protocol, const BenchmarkSequence& sequence) {
  const double last_s = secondsBetween(sequence.first_image, sequence.last_image);
  const double room_s = last_s - protocol.seconds + kTolerance;
  std::vector<double> starts;
  if (!protocol.from_s.empty()) {
    for (const double from_s : protocol.from_s)
      if (fits(protocol, from_s, last_s)) starts.push_back(from_s);
    return starts;
  }
  if (room_s < 0.0) return starts;
  const int count = protocol.seconds > 0.0 ? protocol.starts : 1;
  for (int i = 0; i < count; ++i) {
    const double from_s =
        count == 1 ? 0.0 : std::floor(10.0 * std::max(0.0, room_s) * i / (count - 1)) / 10.0;
    if (starts.empty() || from_s > starts.back()) starts.push_back(from_s);
  }
  return starts;
}

std::vector<std::string> tooShort(const TrialRecord& record) {
  const TrialProtocol& protocol = record.protocol;
  const std::string runs = protocol.seconds > 0.0
                               ? format(": too short for runs of %g s", protocol.seconds)
                               : std::string(": too short for runs to its end");
  std::vector<std::string> sentences;
  for (const BenchmarkSequence& sequence : record.sequences) {
    if (!sequence.error.empty()) continue;
    const double last_s = secondsBetween(sequence.first_image, sequence.last_image);
    const auto add = [&](const std::string& from, double needs_s) {
      std::string sentence = sequence.name + runs;
      sentence += from;
      sentence += format(" (needs %.2f s, has %.2f s): ", needs_s, last_s);
      sentence += startsOf(protocol, sequence).empty() ? "0 runs" : "none from there";
      sentences.push_back(std::move(sentence));
    };
    if (protocol.from_s.empty() && startsOf(protocol, sequence).empty())
      add("", protocol.seconds - kTolerance);
    for (const double from_s : protocol.from_s)
      if (!fits(protocol, from_s, last_s))
        add(format(" from %g s", from_s),
            from_s + std::max(protocol.seconds - kTolerance, kTolerance));
  }
  return sentences;
}

std::string resultKey(const TrialRun& run) {
  const TrialVariant& v = run.variant;
  return joinedFilled({run.recording, format("from %.9g s", run.from_s), v.system, v.setting,
                       v.odometry, v.initializer, run.fault},
                      ", ");
}

std::string trajectoryName(const std::string& recording, double from_s, const std::string& fault) {
  return fileName(recording + format("-%g-", from_s) + fault) + ".tum";
}

std::string folderName(const TrialVariant& variant) {
  return fileName(
      joinedFilled({variant.system, variant.setting, variant.odometry, variant.initializer}, "-"));
}

std::string runsCsv(const std::vector<TrialRun>& runs) {
  std::string text =
      "recording,from_s,system,setting,odometry,initializer,fault,status,silent,reason,seconds,"
      "images,frames,poses,coverage,fault_at_s,started_s,end_state,dead_reckoning_s,lost_s,event";
  for (const char* which : {"causal", "smoothed"})
    for (const char* error : {"ate_m", "ate_yaw_m", "rotation_deg", "rpe_m", "rpe_deg"})
      text += std::string(",") + which + "_" + error;
  text += ",error_over_predicted";
  for (const double after_s : timesAfterStart()) {
    const std::string when = after_s > 0.0 ? format("after_%gs_", after_s) : "at_end_";
    for (const char* error : {"ate_m", "velocity_mps", "tilt_deg"}) text += "," + when + error;
  }
  text += ",frame_ms\n";
  for (const TrialRun& run : runs) {
    std::string line = csvField(run.recording) + "," + csvNumber(run.from_s);
    for (const std::string& name : {run.variant.system, run.variant.setting, run.variant.odometry,
                                    run.variant.initializer, run.fault, run.status})
      line += "," + csvField(name);
    line += std::string(run.silent ? ",1," : ",0,") + csvField(run.reason) + "," +
            csvNumber(run.seconds);
    for (const int count : {run.images, run.frames, run.poses}) line += "," + std::to_string(count);
    for (const double value : {run.coverage(), run.fault_at_s, run.started_s})
      line += "," + csvNumber(value);
    line += "," + csvField(run.end_state) + "," + csvNumber(run.dead_reckoning_s) + "," +
            csvNumber(run.lost_s) + "," + csvField(run.event);
    appendErrors(run.causal, &line);
    appendErrors(run.smoothed, &line);
    line += "," + csvNumber(run.error_over_predicted);
    for (size_t i = 0; i < timesAfterStart().size(); ++i) {
      const ErrorsAfterStart after =
          i < run.after_start.size() ? run.after_start[i] : ErrorsAfterStart();
      for (const double value : {after.ate_m, after.velocity_mps, after.tilt_deg})
        line += "," + csvNumber(value);
    }
    text += line + "," + csvNumber(run.frame_ms) + "\n";
  }
  return text;
}

}  // namespace etalon
