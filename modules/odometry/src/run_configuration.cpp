#include "etalon/odometry/run_configuration.h"

#include <filesystem>
#include <sstream>

#include "etalon/core/errors.h"

namespace etalon {

namespace {

struct PluginOptions {
  std::string path;

  ParameterSet parameters() {
    ParameterSet set("plugins");
    set.add("path", &path,
            "Folders or libraries in which initializer plugins are searched first, separated by "
            "':'.");
    return set;
  }
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ':');)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

}  // namespace

RunConfiguration loadRunConfiguration(const IniFile& ini,
                                      const std::vector<std::string>& plugin_path) {
  RunConfiguration run;
  PluginOptions plugin_options;
  std::vector<ParameterSet> sections = run.pipeline.sections();
  sections.push_back(plugin_options.parameters());
  std::vector<std::string> known;
  for (const ParameterSet& section : sections) {
    section.read(ini);
    known.push_back(section.section());
  }
  std::vector<std::string> search = plugin_path;
  for (const std::string& folder : split(plugin_options.path)) {
    if (!std::filesystem::exists(folder))
      throw ConfigError(ini.section("plugins").at("path").origin + ": [plugins] path = '" +
                        plugin_options.path + "': there is no '" + folder +
                        "'; expected folders or libraries, separated by ':'");
    search.push_back(folder);
  }
  PluginLoader loader(PluginLoader::defaultSearchPath(search));
  run.initializer = loader.create(run.pipeline.initializer);
  run.plugin = loader.info(run.pipeline.initializer);
  ParameterSet own(run.plugin.name);
  run.initializer->declareParameters(own);
  own.read(ini);
  known.push_back(own.section());
  for (const PluginInfo& other : loader.available()) {
    if (other.name == run.plugin.name) continue;
    known.push_back(other.name);
    if (ini.section(other.name).empty()) continue;
    const Initializer::Ptr initializer = loader.create(other.name);
    ParameterSet parameters(other.name);
    initializer->declareParameters(parameters);
    parameters.read(ini);
  }
  checkSections(ini, known);

  for (const ParameterSet& section : sections) run.effective_ini += section.toIni() + "\n";
  run.effective_ini += own.toIni();
  return run;
}

}  // namespace etalon
