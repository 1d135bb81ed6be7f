#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "etalon/datasets/sensor_source.h"

namespace etalon::app {

/** --fault and --fault-seed of a command that reads a recording. The object must live until the
 * command has run. */
struct FaultOption {
  std::string text;  ///< as on a line of config/faults.ini; empty: none
  std::uint64_t seed = 1;

  void add(CLI::App* command);

  bool given() const { return !text.empty(); }

  /** The source that `open` gives, with the faults if there are any; their seconds count from
   * `start_s` on. The text is read before anything is opened. @throws ConfigError */
  std::unique_ptr<SensorSource> apply(const std::function<std::unique_ptr<SensorSource>()>& open,
                                      double start_s) const;
};

}  // namespace etalon::app
