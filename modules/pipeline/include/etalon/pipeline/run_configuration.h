#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/ini_file.h"
#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/pipeline.h"

namespace etalon {

/** An initializer with the parameters of its section. */
struct ConfiguredInitializer {
  PluginInfo plugin;
  Initializer::Ptr initializer;
  std::string ini;  ///< its section: documentation and values in use
};

/** The pipeline as configured, and several initializers to try in it. */
struct SuiteConfiguration {
  PipelineOptions pipeline;
  std::vector<ConfiguredInitializer> initializers;
  /** The sections of the pipeline with documentation and values in use. */
  std::string pipeline_ini;
};

/** A run as configured: every option resolved, the initializer loaded. */
struct RunConfiguration {
  PipelineOptions pipeline;
  PluginInfo plugin;  ///< with `initializer = auto`: the moving one's, under the name "auto"
  std::optional<PluginInfo> at_rest_plugin;  ///< with `initializer = auto`
  PipelineInitializers initializers;
  /** All sections with documentation and the values in use; reading it gives the same run. */
  std::string effective_ini;
};

/**
 * Reads the sections of the pipeline, [plugins] and one section a plugin, strictly: unknown
 * sections and keys, unparsable and out-of-range values are ConfigErrors. Sections of plugins that
 * are not chosen are checked too.
 *
 * @param plugin_path folders or libraries searched before those that [plugins] names
 */
RunConfiguration loadRunConfiguration(const IniFile& ini,
                                      const std::vector<std::string>& plugin_path);

/** The two initializers that the papers compare first, side by side, then the others from A to Z.
 */
std::vector<std::string> inOrderOfDisplay(std::vector<std::string> names);

/**
 * The same for several initializers.
 * @param names of the initializers in the order wanted, each once; empty: all that can be loaded,
 *        inOrderOfDisplay()
 */
SuiteConfiguration loadSuiteConfiguration(const IniFile& ini,
                                          const std::vector<std::string>& plugin_path,
                                          const std::vector<std::string>& names);

}  // namespace etalon
