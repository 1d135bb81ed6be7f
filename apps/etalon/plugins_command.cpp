#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/core/process/isolated_run.h"
#include "etalon/initialization/plugin_loader.h"

namespace etalon::app {

namespace {

struct PluginsArguments {
  std::vector<std::string> plugin_path;
  std::string describe;
  bool ini = false;
};

/** Columns as wide as their widest cell; the last one is not padded. */
void printTable(const std::vector<std::vector<std::string>>& rows) {
  std::vector<size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const auto& row : rows) {
    for (size_t i = 0; i + 1 < row.size(); ++i) {
      std::printf("%-*s  ", static_cast<int>(widths[i]), row[i].c_str());
    }
    std::printf("%s\n", row.back().c_str());
  }
}

/** `text` indented and broken at blanks before column 100. */
void printIndented(const std::string& text, size_t indent) {
  const size_t width = 100 - indent;
  for (size_t start = 0; start < text.size();) {
    size_t end = std::min(start + width, text.size());
    if (end < text.size()) {
      const size_t blank = text.rfind(' ', end);
      if (blank != std::string::npos && blank > start) end = blank;
    }
    std::printf("%*s%s\n", static_cast<int>(indent), "", text.substr(start, end - start).c_str());
    start = end < text.size() && text[end] == ' ' ? end + 1 : end;
  }
}

void printSection(PluginLoader* loader, const std::string& name) {
  const Initializer::Ptr initializer = loader->create(name);
  ParameterSet parameters(loader->info(name).name);
  initializer->declareParameters(parameters);
  std::printf("%s", parameters.toIni().c_str());
}

void printDescription(PluginLoader* loader, const std::string& name) {
  const PluginInfo info = loader->info(name);
  const Initializer::Ptr initializer = loader->create(name);
  std::printf("%s %s: %s\n", info.name.c_str(), info.version.c_str(), info.description.c_str());
  printTable({{"library", info.path},
              {"class", info.class_name},
              {"stereo odometry", initializer->needsVisualSolution() ? "used" : "not used"}});
  ParameterSet parameters(info.name);
  initializer->declareParameters(parameters);
  const auto descriptions = parameters.describe();
  if (descriptions.empty()) {
    std::printf("\nIt has no parameters.\n");
    return;
  }
  std::printf("\nParameters, INI section [%s]:\n", info.name.c_str());
  for (const auto& d : descriptions) {
    std::printf("  %s = %s   (%s%s%s)\n", d.key.c_str(), d.default_value.c_str(), d.type.c_str(),
                d.range.empty() ? "" : ", ", d.range.c_str());
    printIndented(d.doc, 6);
  }
}

/** Where to look for plugins, and which libraries must not be loaded here. */
struct SearchPath {
  std::vector<std::string> entries;
  std::vector<RejectedPlugin> crashing;
};

/** Loads a library and makes its initializer in a process of its own. Returns how that process
 * crashed, or nothing. The second try, in this process, reports ordinary errors. */
std::string crashOf(const std::string& library) {
  IsolationLimits limits;
  limits.cpu_s = 10.0;
  const IsolatedOutcome outcome = runIsolated(
      [&library]() -> std::string {
        PluginLoader loader({library});
        try {
          for (const PluginInfo& info : loader.available()) {
            ParameterSet parameters(info.name);
            loader.create(info.path)->declareParameters(parameters);
          }
        } catch (const Error&) {
        }
        return "";
      },
      limits);
  // An exception is not a crash.
  const bool threw = outcome.failure.rfind("threw", 0) == 0;
  return outcome.completed || threw ? "" : outcome.failure;
}

/** The libraries that an entry of the search path stands for, in the loader's order. */
std::vector<std::string> librariesOf(const std::string& entry) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_regular_file(entry, error)) return {entry};
  std::vector<std::string> libraries;
  for (fs::directory_iterator i(entry, error), end; !error && i != end; i.increment(error))
    if (i->path().extension() == ".so") libraries.push_back(i->path().string());
  std::sort(libraries.begin(), libraries.end());
  return libraries;
}

/** The search path without the libraries that would crash this program. */
SearchPath withoutCrashes(const std::vector<std::string>& search_path) {
  SearchPath safe;
  for (const std::string& entry : search_path) {
    std::vector<std::string> good;
    const size_t crashing_before = safe.crashing.size();
    for (const std::string& library : librariesOf(entry)) {
      const std::string crash = crashOf(library);
      if (crash.empty())
        good.push_back(library);
      else
        safe.crashing.push_back({library, "while being loaded it " + crash});
    }
    if (safe.crashing.size() == crashing_before) good = {entry};
    safe.entries.insert(safe.entries.end(), good.begin(), good.end());
  }
  return safe;
}

int printList(PluginLoader* loader, const std::vector<std::string>& search_path,
              const std::vector<RejectedPlugin>& crashing) {
  std::vector<std::vector<std::string>> rows = {{"NAME", "VERSION", "DESCRIPTION", "LIBRARY"}};
  for (const PluginInfo& info : loader->available()) {
    rows.push_back({info.name, info.version, info.description, info.path});
  }
  if (rows.size() > 1) {
    printTable(rows);
  } else {
    std::printf("No initializer found. Searched:\n");
    for (const std::string& entry : search_path) std::printf("  %s\n", entry.c_str());
  }
  std::vector<RejectedPlugin> rejected = loader->rejected();
  rejected.insert(rejected.end(), crashing.begin(), crashing.end());
  if (!rejected.empty()) std::printf("\nNot usable:\n");
  for (const RejectedPlugin& plugin : rejected) {
    std::printf("  %s\n", plugin.path.c_str());
    printIndented(plugin.reason, 6);
  }
  return rows.size() > 1 ? kOk : kUsageError;
}

int describe(PluginLoader* loader, const PluginsArguments& arguments,
             const std::vector<RejectedPlugin>& crashing) {
  const std::string& name = arguments.describe;
  const bool is_path = name.find('/') != std::string::npos;
  try {
    const std::string crash = is_path ? crashOf(name) : "";
    if (!crash.empty()) throw PluginError(name + ": while being loaded it " + crash);
    for (const RejectedPlugin& plugin : crashing)
      if (!is_path && std::filesystem::path(plugin.path).stem() == name)
        throw PluginError(plugin.path + ": " + plugin.reason);
    if (arguments.ini) {
      printSection(loader, name);
    } else {
      printDescription(loader, name);
    }
    return kOk;
  } catch (const PluginError& e) {
    std::cerr << "etalon: " << e.what() << "\n";
    return kCannotBeLoaded;
  }
}

int listPlugins(const PluginsArguments& arguments) {
  const auto search_path = PluginLoader::defaultSearchPath(arguments.plugin_path);
  const SearchPath safe = withoutCrashes(search_path);
  PluginLoader loader(safe.entries);
  if (!arguments.describe.empty()) return describe(&loader, arguments, safe.crashing);
  if (!arguments.ini) return printList(&loader, search_path, safe.crashing);
  for (const PluginInfo& info : loader.available()) {
    printSection(&loader, info.name);
    std::printf("\n");
  }
  return loader.available().empty() ? kUsageError : kOk;
}

}  // namespace

void addPluginsCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<PluginsArguments>();
  CLI::App* command =
      app.add_subcommand("plugins", "List the initializers that can be loaded, and describe them.");
  command
      ->add_option("--plugin-path", arguments->plugin_path,
                   "Folder or library to search before the usual ones; may be repeated.")
      ->check(CLI::ExistingPath)
      ->type_name("DIR")
      ->allow_extra_args(false);
  command
      ->add_option("--describe", arguments->describe,
                   "Describe this initializer (a name, or the path of its library) and its "
                   "parameters: type, default, range, meaning.")
      ->type_name("NAME");
  command->add_flag("--ini", arguments->ini,
                    "Print ready INI sections with documentation: of the initializer that "
                    "--describe names, or of all.");
  command->footer(
      "Exit codes: 0 done, 2 usage, or no initializer is there, 3 the one that --describe names "
      "cannot be found or loaded.");
  command->callback([arguments, exit_code] { *exit_code = listPlugins(*arguments); });
}

}  // namespace etalon::app
