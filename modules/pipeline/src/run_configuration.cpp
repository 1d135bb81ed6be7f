#include "etalon/pipeline/run_configuration.h"

#include <algorithm>
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

/** Everything but the initializers: reads and checks the sections of the pipeline and [plugins]. */
class ConfigurationReader {
 public:
  ConfigurationReader(const IniFile& ini, const std::vector<std::string>& plugin_path,
                      PipelineOptions* pipeline)
      : ini_(ini) {
    PluginOptions plugin_options;
    std::vector<ParameterSet> sections = pipeline->sections();
    sections.push_back(plugin_options.parameters());
    for (const ParameterSet& section : sections) {
      section.read(ini);
      known_.push_back(section.section());
      pipeline_ini_ += section.toIni() + "\n";
    }
    readFlights(ini);  // of a device file: only whether they can be read
    known_.emplace_back(kFlightsSection);
    checkOdd("klt_window_px", pipeline->frontend.klt_window_px);
    checkOdd("anchor_window_px", pipeline->frontend.anchor_window_px);
    checkFlightFeatures(pipeline->frontend);
    std::vector<std::string> search = plugin_path;
    for (const std::string& folder : split(plugin_options.path)) {
      if (!std::filesystem::exists(folder))
        throw ConfigError(ini.section("plugins").at("path").origin + ": [plugins] path = '" +
                          plugin_options.path + "': there is no '" + folder +
                          "'; expected folders or libraries, separated by ':'");
      search.push_back(folder);
    }
    loader_ = std::make_unique<PluginLoader>(PluginLoader::defaultSearchPath(search));
  }

  PluginLoader& loader() { return *loader_; }
  const std::string& pipelineIni() const { return pipeline_ini_; }

  /** The initializer that the key names; an error says where the key stands. */
  ConfiguredInitializer initializerOfKey(const std::string& section, const std::string& key,
                                         const std::string& name) {
    requireInitializerOfKey(section, key);
    return initializer(name);
  }

  /** A new instance of the initializer `name`, its section read. */
  ConfiguredInitializer initializer(const std::string& name) {
    ConfiguredInitializer configured;
    configured.initializer = loader_->create(name);
    configured.plugin = loader_->info(name);
    ParameterSet own(configured.plugin.name);
    configured.initializer->declareParameters(own);
    own.read(ini_);
    configured.ini = own.toIni();
    known_.push_back(own.section());
    return configured;
  }

  /** The names in [auto], and the sections of the plugins that were not chosen, are checked, too;
   * then that there is no other section. */
  void checkRest() {
    for (const char* key : {"moving", "at_rest"}) requireInitializerOfKey(kAutoInitializer, key);
    for (const PluginInfo& other : loader_->available()) {
      if (std::find(known_.begin(), known_.end(), other.name) != known_.end()) continue;
      if (!ini_.section(other.name).empty()) initializer(other.name);
      known_.push_back(other.name);
    }
    checkSections(ini_, known_);
  }

 private:
  /** @throws PluginError saying where the key stands, if it names an initializer that there is not */
  void requireInitializerOfKey(const std::string& section, const std::string& key) {
    const auto& values = ini_.section(section);
    const auto value = values.find(key);
    if (value == values.end()) return;
    try {
      loader_->info(value->second.text);
    } catch (const PluginError& e) {
      throw PluginError(value->second.origin + ": [" + section + "] " + key + " = '" +
                        value->second.text + "': " + e.what());
    }
  }

  /** In flight no more features can be followed than before it. The default gives way to a smaller
   * max_features. */
  void checkFlightFeatures(const StereoTrackerOptions& options) const {
    if (options.flight_features <= options.max_features ||
        options.flight_features == StereoTrackerOptions().flight_features)
      return;
    throw ConfigError(ini_.section("frontend").at("flight_features").origin +
                      ": [frontend] flight_features = '" + std::to_string(options.flight_features) +
                      "': expected at most max_features, " + std::to_string(options.max_features));
  }

  /** A patch of the front end has a pixel in its middle. */
  void checkOdd(const std::string& key, int value) const {
    if (value % 2 != 0) return;
    const IniFile::Value& text = ini_.section("frontend").at(key);  // the defaults are odd
    throw ConfigError(text.origin + ": [frontend] " + key + " = '" + text.text +
                      "': expected an odd integer");
  }

  const IniFile& ini_;
  std::vector<std::string> known_;
  std::string pipeline_ini_;
  std::unique_ptr<PluginLoader> loader_;
};

}  // namespace

RunConfiguration loadRunConfiguration(const IniFile& ini,
                                      const std::vector<std::string>& plugin_path) {
  RunConfiguration run;
  ConfigurationReader reader(ini, plugin_path, &run.pipeline);
  const bool automatic = run.pipeline.initializer == kAutoInitializer;
  const AutoOptions& names = run.pipeline.auto_initializer;
  ConfiguredInitializer configured =
      automatic ? reader.initializerOfKey(kAutoInitializer, "moving", names.moving)
                : reader.initializerOfKey("pipeline", "initializer", run.pipeline.initializer);
  run.plugin = configured.plugin;
  run.initializers.name = configured.plugin.name;
  run.initializers.initializer = configured.initializer;
  run.effective_ini = reader.pipelineIni() + configured.ini;
  if (automatic) {
    if (names.at_rest == names.moving)
      throw ConfigError("[auto] at_rest and moving name the same initializer, '" + names.moving +
                        "'; name it in [pipeline] initializer instead");
    const ConfiguredInitializer at_rest =
        reader.initializerOfKey(kAutoInitializer, "at_rest", names.at_rest);
    run.initializers.at_rest = at_rest.initializer;
    run.initializers.at_rest_name = at_rest.plugin.name;
    run.at_rest_plugin = at_rest.plugin;
    run.effective_ini += "\n" + at_rest.ini;
    run.plugin.name = kAutoInitializer;
  }
  reader.checkRest();
  return run;
}

std::vector<std::string> inOrderOfDisplay(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  auto next = names.begin();
  for (const char* first : {"eta", "orbslam3_inertial_only"})
    if (const auto found = std::find(next, names.end(), first); found != names.end())
      next = std::rotate(next, found, found + 1);
  return names;
}

SuiteConfiguration loadSuiteConfiguration(const IniFile& ini,
                                          const std::vector<std::string>& plugin_path,
                                          const std::vector<std::string>& names) {
  SuiteConfiguration suite;
  ConfigurationReader reader(ini, plugin_path, &suite.pipeline);
  std::vector<std::string> wanted = names;
  if (wanted.empty()) {
    for (const PluginInfo& plugin : reader.loader().available()) wanted.push_back(plugin.name);
    wanted = inOrderOfDisplay(std::move(wanted));
  }
  if (wanted.empty()) throw PluginError("no initializer plugin was found; see `etalon plugins`");
  for (const std::string& name : wanted) {
    if (name == kAutoInitializer)
      throw ConfigError(
          "'auto' is for replay alone, where one initializer hands over to another; name the "
          "initializers themselves, e.g. static and eta");
    suite.initializers.push_back(reader.initializer(name));
    const std::string& chosen = suite.initializers.back().plugin.name;
    for (size_t i = 0; i + 1 < suite.initializers.size(); ++i)
      if (suite.initializers[i].plugin.name == chosen)
        throw ConfigError("the initializer '" + chosen + "' is named twice");
  }
  reader.checkRest();
  suite.pipeline_ini = reader.pipelineIni();
  return suite;
}

}  // namespace etalon
