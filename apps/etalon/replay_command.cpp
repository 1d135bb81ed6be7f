#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/odometry/run_configuration.h"

namespace etalon::app {

namespace {

struct Arguments {
  std::string source, config, initializer, out = "out/replay";
  std::vector<std::string> set, plugin_path;
  double from_s = 0.0, to_s = 1e18;
};

/** The live line: time in the recording, frames per second, state. */
class ProgressLine {
 public:
  void update(const Pipeline& pipeline, const PipelineOptions& options, double seconds,
              bool force = false) {
    const auto now = std::chrono::steady_clock::now();
    const double period_s = isatty(STDERR_FILENO) ? 0.2 : 5.0;
    if (!force && std::chrono::duration<double>(now - printed_).count() < period_s) return;
    printed_ = now;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double fps = static_cast<double>(pipeline.timings().size()) / std::max(1e-9, elapsed);
    std::string state = "initialised";
    if (pipeline.state() == PipelineState::kCollecting)
      state = pipeline.attempts().empty()
                  ? "collecting keyframes " + std::to_string(pipeline.keyframesCollected()) + "/" +
                        std::to_string(options.keyframes)
                  : "not yet (" + std::to_string(pipeline.attempts().size()) + " attempts)";
    std::fprintf(stderr, "%sreplay: %7.2f s  %5.1f frames/s  %-34s%s", tty() ? "\r" : "", seconds,
                 fps, state.c_str(), tty() && !force ? "" : "\n");
    std::fflush(stderr);
  }

 private:
  static bool tty() { return isatty(STDERR_FILENO) != 0; }
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point printed_ = start_;
};

IniFile readConfiguration(const Arguments& arguments) {
  IniFile ini = arguments.config.empty() ? IniFile::fromText("", "(defaults)")
                                         : IniFile::fromFile(arguments.config);
  if (!arguments.initializer.empty())
    ini.set("pipeline", "initializer", arguments.initializer, "--initializer");
  for (const std::string& argument : arguments.set) ini.setFromArgument(argument);
  return ini;
}

int replay(const Arguments& arguments) {
  const RunConfiguration run =
      loadRunConfiguration(readConfiguration(arguments), arguments.plugin_path);
  SourceOptions source_options;
  source_options.from_s = arguments.from_s;
  source_options.to_s = arguments.to_s;
  const auto source = openSource(arguments.source, source_options);
  std::filesystem::create_directories(arguments.out);

  Pipeline pipeline(source->calibration(), run.pipeline, run.initializer);
  ProgressLine progress;
  TimeNs first = 0, last = 0;
  size_t reported = 0;
  while (const auto event = source->next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*event)) {
      pipeline.add(*imu);
    } else {
      const StereoFrame& frame = std::get<StereoFrame>(*event);
      if (first == 0) first = frame.t;
      last = frame.t;
      pipeline.add(frame);
    }
    for (; reported < pipeline.attempts().size(); ++reported) {
      const InitializationAttempt& attempt = pipeline.attempts()[reported];
      std::printf("%.2f s: %s%s\n", secondsBetween(first, attempt.t),
                  attempt.decision.accepted ? "initialised" : "not yet, because ",
                  attempt.decision.reason.c_str());
    }
    progress.update(pipeline, run.pipeline, secondsBetween(first, last));
  }
  pipeline.finish();
  progress.update(pipeline, run.pipeline, secondsBetween(first, last), true);
  const std::filesystem::path out = arguments.out;
  writeTum((out / "trajectory.tum").string(), pipeline.trajectory());
  std::ofstream(out / "config.ini") << run.effective_ini;
  return pipeline.state() == PipelineState::kInitialized ? kOk : kNotInitialised;
}

}  // namespace

void addReplayCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Run the pipeline on a recording: initialise through a plugin, then odometry.");
  command->add_option("SRC", arguments->source, "EuRoC folder or .rawlog")->required();
  command->add_option("-c,--config", arguments->config, "INI file (default: built-in values)");
  command->add_option("--initializer", arguments->initializer, "Initializer plugin to use");
  command->add_option("--from", arguments->from_s, "Start, seconds after the first image");
  command->add_option("--to", arguments->to_s, "End, seconds after the first image");
  command->add_option("--set", arguments->set, "Override: section.key=value (repeatable)");
  command->add_option("--plugin-path", arguments->plugin_path,
                      "Folder or library searched first for plugins (repeatable)");
  command->add_option("--out", arguments->out, "Folder for the results")->capture_default_str();
  command->callback([arguments, exit_code] { *exit_code = replay(*arguments); });
}

}  // namespace etalon::app
