#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.h"
#include "etalon/contract/contract.h"
#include "etalon/core/errors.h"
#include "etalon/core/ini_file.h"
#include "etalon/core/parameters.h"
#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/run_configuration.h"
#include "options/configuration_options.h"
#include "support/stop_on_signals.h"

namespace etalon::app {

namespace {

constexpr int kContractBroken = 1;  // this command's own exit code
constexpr char kAllMotionsWord[] = "all";

struct CheckPluginArguments {
  std::string plugin;
  std::vector<std::string> plugin_path, set, motions;
  std::string config, output_format = "text";
  bool list = false;
  ContractOptions options;
};

/** The initializer with the parameters that the INI and --set give it. */
struct Subject {
  PluginInfo info;
  Initializer::Ptr initializer;
};

/** The file's content and what --set adds. Refuses a file without the plugin's section, because the
 * defaults would be checked silently. */
IniFile readIni(const CheckPluginArguments& arguments, const std::string& name) {
  IniFile ini;
  if (!arguments.config.empty()) {
    ini = IniFile::fromFile(arguments.config);
    const std::vector<std::string> sections = ini.sections();
    if (std::find(sections.begin(), sections.end(), name) == sections.end()) {
      const std::string nearest = nearestWord(name, sections);
      throw ConfigError(arguments.config + ": expected a section [" + name +
                        "] with the parameters to check" +
                        (nearest.empty() ? "" : " (is [" + nearest + "] meant?)"));
    }
  }
  for (const std::string& argument : arguments.set) {
    if (argument.find('=') == std::string::npos)
      throw ConfigError("--set: '" + argument + "': expected key=value");
    std::string with_section = name;
    with_section.append(".").append(argument);
    const bool has_section = argument.find('.') < argument.find('=');
    ini.setFromArgument(has_section ? argument : with_section);
  }
  return ini;
}

/** What --motions may say. */
std::vector<std::string> motionNames() {
  std::vector<std::string> names = {kAllMotionsWord};
  for (const testing::Motion motion : testing::kAllMotions) names.emplace_back(toString(motion));
  return names;
}

/** Empty where nothing is said. */
std::vector<testing::Motion> motionsOf(const std::vector<std::string>& said) {
  std::vector<testing::Motion> motions;
  const auto isSaid = [&said](const char* name) {
    return std::find(said.begin(), said.end(), name) != said.end();
  };
  for (const testing::Motion motion : testing::kAllMotions)
    if (isSaid(kAllMotionsWord) || isSaid(toString(motion))) motions.push_back(motion);
  return motions;
}

Subject loadSubject(const CheckPluginArguments& arguments) {
  PluginLoader loader(PluginLoader::defaultSearchPath(arguments.plugin_path));
  Subject subject;
  subject.info = loader.info(arguments.plugin);
  const IniFile ini = readIni(arguments, subject.info.name);
  if (ini.sections().empty()) {
    subject.initializer = loader.create(arguments.plugin);
    return subject;
  }
  // Every other command reads the file like this: unknown sections and keys are refused.
  const SuiteConfiguration suite =
      loadSuiteConfiguration(ini, arguments.plugin_path, {arguments.plugin});
  subject.initializer = suite.initializers.front().initializer;
  return subject;
}

/** Loads the plugin in a process of its own first, because a library may crash while it is loaded.
 * The second try, in this process, reports ordinary errors. */
std::string crashWhileLoading(const CheckPluginArguments& arguments) {
  const IsolatedOutcome outcome = runIsolated(
      [&]() -> std::string {
        try {
          loadSubject(arguments);
        } catch (const Error&) {
        }
        return "";
      },
      arguments.options.limits);
  return outcome.completed ? "" : outcome.failure;
}

const char* verdictColumn(ContractCheck::Verdict verdict) {
  switch (verdict) {
    case ContractCheck::Verdict::kPassed:
      return "passed ";
    case ContractCheck::Verdict::kRefused:
      return "refused";
    case ContractCheck::Verdict::kNotApplicable:
      return "none   ";
    default:
      return "FAILED ";
  }
}

void printCheck(const ContractCheck& check) {
  std::printf("%s  %-29s %s\n", verdictColumn(check.verdict), check.name.c_str(),
              check.detail.c_str());
  for (const std::string& line : check.by_motion) std::printf("%40s%s\n", "", line.c_str());
  std::fflush(stdout);
}

void printContractSummary(const Subject& subject, const ContractReport& report) {
  using Verdict = ContractCheck::Verdict;
  std::printf("\n%s %s: %d passed, %d refused as it may, %d failed", subject.info.name.c_str(),
              subject.info.version.c_str(), report.count(Verdict::kPassed),
              report.count(Verdict::kRefused), report.count(Verdict::kFailed));
  if (report.count(Verdict::kNotApplicable) > 0) std::printf("; gives no covariance");
  if (report.milliseconds_per_call > 0.0)
    std::printf("; %.3g ms a call", report.milliseconds_per_call);
  std::printf("\n");
  if (!report.stopped.empty()) std::printf("%s\n", report.stopped.c_str());
}

void printJson(const Subject& subject, const ContractReport& report) {
  nlohmann::ordered_json json;
  json["plugin"] = subject.info.name;
  json["version"] = subject.info.version;
  json["library"] = subject.info.path;
  json["ok"] = report.ok();
  json["milliseconds_per_call"] = nullptr;  // not measured
  if (report.milliseconds_per_call > 0.0)
    json["milliseconds_per_call"] = report.milliseconds_per_call;
  json["stopped"] = report.stopped;
  json["checks"] = nlohmann::ordered_json::array();
  for (const ContractCheck& check : report.checks) {
    json["checks"].push_back({{"name", check.name},
                              {"verdict", toString(check.verdict)},
                              {"detail", check.detail},
                              {"value", check.value},
                              {"failures", check.failures},
                              {"by_motion", check.by_motion}});
  }
  // A plugin's texts need not be UTF-8.
  std::printf("%s\n",
              json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

int listChecks() {
  for (const ContractCheckDescription& check : contractChecks())
    std::printf("%-29s %s\n", check.name.c_str(), check.description.c_str());
  return kOk;
}

int checkPlugin(const CheckPluginArguments& arguments) {
  if (arguments.list) return listChecks();
  if (arguments.plugin.empty()) throw ConfigError("check-plugin: which plugin? (a name or a path)");
  endOnSignals("check-plugin: interrupted; the plugin is not judged");
  const std::string crash = crashWhileLoading(arguments);
  if (!crash.empty()) {
    std::cerr << "etalon: " << arguments.plugin << ": while being loaded it " << crash << "\n";
    return kCannotBeLoaded;
  }
  Subject subject;
  try {
    subject = loadSubject(arguments);
  } catch (const PluginError& e) {
    std::cerr << "etalon: " << e.what() << "\n";
    return kCannotBeLoaded;
  }
  const bool text = arguments.output_format == "text";
  if (text)
    std::printf("%s %s, %s\n\n", subject.info.name.c_str(), subject.info.version.c_str(),
                subject.info.path.c_str());
  ContractOptions options = arguments.options;
  options.monte_carlo_motions = motionsOf(arguments.motions);
  const ContractReport report =
      checkContract(*subject.initializer, options, [text](const ContractCheck& check) {
        if (text) printCheck(check);
      });
  if (text) {
    printContractSummary(subject, report);
  } else {
    printJson(subject, report);
  }
  return report.ok() ? kOk : kContractBroken;
}

void addSuiteOptions(CLI::App* command, CheckPluginArguments* arguments) {
  ContractOptions* o = &arguments->options;
  command
      ->add_option("--only", o->only,
                   "Run this check only, or with a '.' at its end those that begin so; repeatable")
      ->type_name("CHECK")
      ->allow_extra_args(false);
  command
      ->add_option("--allow-nees", o->allowed_nees_factor,
                   "Let the covariance pass if it is off by no more than this factor (average NEES "
                   "against its expectation, as a whole and of each block), besides what so few "
                   "windows scatter; the plugin's README should say why it needs more")
      ->check(CLI::Range(1.0, 1e9))
      ->capture_default_str()
      ->type_name("FACTOR");
  command->add_option("--windows", o->monte_carlo_windows, "Windows of the Monte Carlo")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  command
      ->add_option("--motions", arguments->motions,
                   "Motions of the Monte Carlo, in turn (default: gentle and aggressive, or the "
                   "first one in which the method gives a covariance)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(motionNames()));
  command
      ->add_option("--cpu-limit", o->limits.cpu_s, "Processor time that a check may use, seconds")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--time-limit", o->limits.clock_s,
                   "Time on the clock that a check may use, seconds (default: twice --cpu-limit). "
                   "After two checks that ran out of time the rest is not run")
      ->check(CLI::Range(1.0, 1e6));
}

}  // namespace

void addCheckPluginCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<CheckPluginArguments>();
  CLI::App* command = app.add_subcommand(
      "check-plugin",
      "Check that an initializer keeps the contract of the interface: exact on noise-free windows, "
      "deterministic, invariant, a status for every bad input, a consistent covariance. Each check "
      "runs in a process of its own.");
  command->add_option("PLUGIN", arguments->plugin,
                      "Name of the initializer, or its library's path");
  addPluginPathOption(command, &arguments->plugin_path);
  command
      ->add_option("-c,--config", arguments->config,
                   "INI file with the plugin's section; other sections must be known, too")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--set", arguments->set,
                   "Override a parameter of the plugin, key=value; repeatable")
      ->allow_extra_args(false);
  addSuiteOptions(command, arguments.get());
  command->add_option("--format", arguments->output_format, "text or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command->add_flag("--list", arguments->list, "List the checks and exit");
  command->footer(
      "Exit codes: 0 the contract is kept, 1 a check failed, 2 usage or configuration, 3 the "
      "plugin cannot be found or loaded, 130 interrupted.");
  command->callback([arguments, exit_code] { *exit_code = checkPlugin(*arguments); });
}

}  // namespace etalon::app
