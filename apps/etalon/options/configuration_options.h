#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/ini_file.h"
#include "etalon/pipeline/device_file.h"

namespace etalon::app {

/** Declares --plugin-path. */
void addPluginPathOption(CLI::App* command, std::vector<std::string>* plugin_path);

/**
 * The configuration of a command that runs the pipeline: -c/--config, --initializer, --set and
 * --plugin-path. Each add...() declares some of them on a subcommand; the order of the calls is the
 * order in --help. The object must live until the command has run.
 */
struct ConfigurationOptions {
  std::vector<std::string> config;         ///< INI files, later ones win; none: built-in values
  std::optional<std::string> initializer;  ///< instead of the INI's
  std::vector<std::string> set;            ///< section.key=value
  std::vector<std::string> plugin_path;    ///< searched before the INI's

  void addConfig(CLI::App* command);
  void addInitializer(CLI::App* command);
  /** Declares --set and --plugin-path. */
  void addOverrides(CLI::App* command);

  /** The INI file after --initializer, then --set were applied. @throws ConfigError */
  IniFile ini() const;

  /** @throws ConfigError if results in the folder would replace a file that was given */
  void requireNotIn(const std::string& out) const;
};

/** "device euroc, 7 flights (config/devices/euroc.ini)"; empty where `ini` has no [device], or
 * one that names no device and counts no flight. */
std::string deviceInWords(const IniFile& ini, const DeviceOptions& device);

}  // namespace etalon::app
