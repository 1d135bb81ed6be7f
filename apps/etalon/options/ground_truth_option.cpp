#include "options/ground_truth_option.h"

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/ground_truth_file.h"

namespace etalon::app {

void GroundTruthOption::add(CLI::App* command) {
  command->add_option(
      "--ground-truth", path,
      "Ground truth in place of the recording's own: EuRoC CSV, TUM file or another "
      "recording, or a folder of them by the recordings' names: NAME.csv, NAME.tum, "
      "NAME/data.csv, NAME (what `etalon ground-truth` writes is one)");
}

void GroundTruthOption::check(const std::vector<std::string>& sources) const {
  if (!path.empty() && sources.size() > 1 && !isGroundTruthFolder(path))
    throw ConfigError("--ground-truth: '" + path +
                      "' belongs to one recording; expected a folder with one for each of the " +
                      std::to_string(sources.size()) + " recordings");
}

std::string GroundTruthOption::of(const std::string& source) const {
  return groundTruthOf(recordingName(source), path);
}

}  // namespace etalon::app
