#include "etalon/benchmark/trial/trajectory_trial.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/runlog/initialization_json.h"
#include "trial/trial_flight.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kStampTolerance = 10'000'000;  // of the stamps of images

/** Which run a file is of. */
struct Part {
  size_t recording = 0;
  double from_s = 0.0;
  std::string fault = kNoFault;
  bool whole = true;

  bool operator<(const Part& o) const {
    return std::tie(recording, from_s, fault) < std::tie(o.recording, o.from_s, o.fault);
  }
};

class TrajectoryTrial {
 public:
  TrajectoryTrial(const std::vector<NamedText>& systems, const std::vector<std::string>& recordings,
                  const TrialProtocol& protocol) {
    record_.protocol = protocol;
    record_.protocol.seconds = 0.0;
    record_.faults = {{kNoFault, ""}};
    requireDifferentNames(recordings);
    for (const std::string& recording : recordings) open(recording);
    for (const NamedText& system : systems) read(system);
  }

  TrialRecord judged() {
    std::set<double> starts;
    std::set<std::string> faults;
    for (const auto& [part, trajectories] : files_) {
      starts.insert(part.from_s);
      if (part.fault != kNoFault) faults.insert(part.fault);
      judge(part, trajectories);
    }
    record_.protocol.from_s.assign(starts.begin(), starts.end());
    for (const std::string& fault : faults) record_.faults.push_back({fault, ""});
    return std::move(record_);
  }

 private:
  struct Opened {
    std::vector<TimeNs> images;
    GroundTruth truth;
  };

  void open(const std::string& recording) {
    SourceOptions options;
    options.decode_images = false;
    const std::unique_ptr<SensorSource> source = openSource(recording, options);
    BenchmarkSequence sequence;
    sequence.name = recordingName(recording);
    sequence.source = recording;
    sequence.first_image = source->imageStamps().front();
    sequence.last_image = source->imageStamps().back();
    sequence.has_ground_truth = !source->groundTruth().empty();
    record_.sequences.push_back(sequence);
    opened_.push_back({source->imageStamps(), source->groundTruth()});
  }

  /** What the file's name says of its run; nothing if it is of none of the recordings. */
  std::optional<Part> partOf(const fs::path& file) const {
    const std::string stem = fileName(file.stem().string());
    for (size_t r = 0; r < record_.sequences.size(); ++r) {
      const std::string name = fileName(record_.sequences[r].name);
      if (stem == name) return Part{r, 0.0, kNoFault, true};
      if (stem.compare(0, name.size() + 1, name + "-") != 0) continue;
      const std::string rest = stem.substr(name.size() + 1);
      char* end = nullptr;
      const double from_s = std::strtod(rest.c_str(), &end);
      if (end != rest.c_str() && *end == '-' && end[1] != 0) return Part{r, from_s, end + 1, false};
    }
    return std::nullopt;
  }

  /** The part that a run (etalon replay) flew, by what it has left beside the file; of the only
   * recording. Nothing where no run lies there, or one of another recording. */
  std::optional<Part> partOfRun(const fs::path& file) const {
    std::ifstream in(file.parent_path() / "initialization.json");
    if (!in) return std::nullopt;
    RunRecord run;
    try {
      run = runRecordFromJson({std::istreambuf_iterator<char>(in), {}}, file.string());
    } catch (const DataError&) {
      return std::nullopt;
    }
    const BenchmarkSequence& sequence = record_.sequences.front();
    if (run.first_image < sequence.first_image || run.first_image > sequence.last_image)
      return std::nullopt;
    const TimeNs last = run.first_image + durationNs(run.statistics.duration_s);
    const bool whole = run.first_image <= sequence.first_image + kStampTolerance &&
                       last >= sequence.last_image - kStampTolerance;
    return Part{0, secondsBetween(sequence.first_image, run.first_image), kNoFault, whole};
  }

  void read(const NamedText& system) {
    for (const NamedText& other : record_.systems)
      if (other.name == system.name)
        throw ConfigError("two systems are called '" + system.name + "'");
    record_.systems.push_back(system);
    bool any = false;
    const auto add = [&](const fs::path& file, const Part& part) {
      files_[part][system.name] = readTum(file.string());
      any = true;
    };
    if (!fs::is_directory(system.text)) {
      std::optional<Part> part = partOf(system.text);
      if (!part && record_.sequences.size() == 1) part = partOfRun(system.text).value_or(Part());
      if (part) add(system.text, *part);
    } else {
      std::set<fs::path> sorted;
      for (const auto& entry : fs::directory_iterator(system.text))
        if (entry.path().extension() == ".tum") sorted.insert(entry.path());
      for (const fs::path& file : sorted)
        if (const auto part = partOf(file)) add(file, *part);
    }
    if (!any)
      throw ConfigError("'" + system.text +
                        "': expected a trajectory RECORDING.tum or RECORDING-FROM-FAULT.tum of a "
                        "recording given");
  }

  /** A run a system: where a folder has no file of it, there is no pose. A system of one file is of
   * that file's part alone. */
  void judge(const Part& part, const std::map<std::string, Trajectory>& trajectories) {
    const BenchmarkSequence& sequence = record_.sequences[part.recording];
    const Opened& opened = opened_[part.recording];
    const TimeNs from = sequence.first_image + durationNs(part.from_s);
    TimeNs to = part.whole ? sequence.last_image : from;
    for (const auto& [name, trajectory] : trajectories)
      if (!trajectory.empty()) to = std::max(to, trajectory.back().t);
    std::vector<TimeNs> images;
    for (const TimeNs t : opened.images)
      if (from - kStampTolerance <= t && t <= to + kStampTolerance) images.push_back(t);
    for (const NamedText& system : record_.systems) {
      const auto trajectory = trajectories.find(system.name);
      if (trajectory == trajectories.end() && !fs::is_directory(system.text)) continue;
      TrialRun run;
      run.recording = sequence.name;
      run.from_s = part.from_s;
      run.variant.system = system.name;
      run.fault = part.fault;
      run.images = static_cast<int>(images.size());
      const Trajectory none;
      etalon::judge(
          flownBySystem(trajectory == trajectories.end() ? none : trajectory->second, images, {}),
          opened.truth, record_.protocol, &run);
      if (trajectory == trajectories.end()) run.reason = "there is no trajectory of it";
      record_.results.push_back(std::move(run));
    }
  }

  TrialRecord record_;
  std::vector<Opened> opened_;                               ///< of record_.sequences
  std::map<Part, std::map<std::string, Trajectory>> files_;  ///< by run and system
};

}  // namespace

TrialRecord trialOfTrajectories(const std::vector<NamedText>& systems,
                                const std::vector<std::string>& recordings,
                                const TrialProtocol& protocol) {
  return TrajectoryTrial(systems, recordings, protocol).judged();
}

}  // namespace etalon
