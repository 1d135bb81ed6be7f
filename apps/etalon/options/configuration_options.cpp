#include "options/configuration_options.h"

#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon::app {

void addPluginPathOption(CLI::App* command, std::vector<std::string>* plugin_path) {
  command
      ->add_option("--plugin-path", *plugin_path,
                   "Folder or library searched first for plugins; repeatable")
      ->check(CLI::ExistingPath)
      ->allow_extra_args(false);
}

void ConfigurationOptions::addConfig(CLI::App* command) {
  command
      ->add_option("-c,--config", config,
                   "INI file; without, built-in values. Repeatable, a device file for instance "
                   "after the run's own; of two values of a key the later counts")
      ->check(CLI::ExistingFile)
      ->allow_extra_args(false);
}

void ConfigurationOptions::addInitializer(CLI::App* command) {
  command->add_option(
      "--initializer", initializer,
      "Initializer plugin (etalon plugins lists them), or auto: static at rest, else the "
      "one of section [auto]");
}

void ConfigurationOptions::addOverrides(CLI::App* command) {
  command->add_option("--set", set, "Override section.key=value; repeatable")
      ->allow_extra_args(false);
  addPluginPathOption(command, &plugin_path);
}

IniFile ConfigurationOptions::ini() const {
  IniFile ini = IniFile::fromText("", "built-in configuration");
  for (const std::string& file : config) ini.add(IniFile::fromFile(file));
  if (initializer) ini.set("pipeline", "initializer", *initializer, "--initializer");
  for (const std::string& argument : set) ini.setFromArgument(argument);
  return ini;
}

void ConfigurationOptions::requireNotIn(const std::string& out) const {
  const std::filesystem::path written = std::filesystem::path(out) / "config.ini";
  std::error_code error;
  for (const std::string& file : config)
    if (std::filesystem::equivalent(file, written, error))
      throw ConfigError(
          format("--out: the results in '%s' would replace %s, which is given with -c; expected "
                 "another folder",
                 out.c_str(), file.c_str()));
}

std::string deviceInWords(const IniFile& ini, const DeviceOptions& device) {
  const auto& values = ini.section("device");
  if (values.empty() || (device.name.empty() && device.flights == 0)) return "";
  const std::string& origin = values.begin()->second.origin;
  return "device " + (device.name.empty() ? "without a name" : device.name) + ", " +
         counted(static_cast<size_t>(device.flights), "flight") + " (" +
         origin.substr(0, origin.rfind(':')) + ")";
}

}  // namespace etalon::app
