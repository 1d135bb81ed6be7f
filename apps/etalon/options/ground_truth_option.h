#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace etalon::app {

/** --ground-truth of a command that reads recordings. */
struct GroundTruthOption {
  std::string path;  ///< empty: the recordings' own

  void add(CLI::App* command);

  /** @throws ConfigError if it is one file for several recordings */
  void check(const std::vector<std::string>& sources) const;

  /** SourceOptions::ground_truth of a recording. @throws DataError if the folder has none of it */
  std::string of(const std::string& source) const;
};

}  // namespace etalon::app
