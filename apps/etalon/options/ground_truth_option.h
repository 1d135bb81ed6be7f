#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "etalon/datasets/sensor_source.h"

namespace etalon::app {

/** Ground truth from a TUM file, a EuRoC CSV, or a recording that has one.
 * @throws DataError naming the file, and the line where there is one */
GroundTruth readGroundTruth(const std::string& path);

/** --ground-truth of a command that reads a recording. */
struct GroundTruthOption {
  std::string file;  ///< empty: the recording's own

  void add(CLI::App* command);

  /** `source` with the file's ground truth in place of its own, where a file is given. */
  std::unique_ptr<SensorSource> apply(std::unique_ptr<SensorSource> source) const;
};

}  // namespace etalon::app
