#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "etalon/benchmark/calibration/flight_over_tracks.h"
#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/process/child_process.h"
#include "etalon/core/text.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/frontend/recording_inspection.h"
#include "etalon/pipeline/flight_bias.h"
#include "etalon/pipeline/run_configuration.h"
#include "noise_table.h"
#include "options/configuration_options.h"
#include "options/recording_option.h"
#include "replay/replay_output.h"
#include "support/checks.h"
#include "support/progress_line.h"
#include "support/stop_on_signals.h"
#include "support/supervised_run.h"

namespace etalon::app {

namespace {

struct CalibrateDeviceArguments {
  std::vector<std::string> sources, without;
  std::string name, base, out, tracks, format = "text";
  ConfigurationOptions configuration;
  double every_s = 2.5, time_limit_s = kDefaultTimeLimitS;
  bool include_rest = false;
};

/** Tracks of a recording; with --tracks from that folder, where they fit. */
SequenceTracks tracksOf(const std::string& source, const CalibrateDeviceArguments& arguments,
                        const PipelineOptions& pipeline) {
  const auto recording = openRecording(source);
  ProgressLine line;
  TrackingOptions tracking = trackingOptions(pipeline);
  tracking.decode_ahead = true;
  tracking.progress = [&](size_t done, size_t all) {
    line.update(done == all, [&] {
      return "calibrate-device: " + recordingName(source) + ": front end " + std::to_string(done) +
             "/" + std::to_string(all) + " frames";
    });
  };
  if (arguments.tracks.empty()) return trackSequence(*recording, tracking);
  return loadOrTrack(*recording, recordingHash(*recording), recordingName(source), arguments.tracks,
                     tracking, nullptr);
}

/** Windows of the same length with keyframes twice as far apart. */
WindowShape atTwiceTheInterval(const WindowShape& shape) {
  return {shape.keyframes / 2 + 1, 0.5 * shape.rate_hz};
}

/** The windows of the recording `name`. */
std::vector<NoiseWindow> windowsOf(const std::string& name,
                                   const std::shared_ptr<const SequenceTracks>& tracks,
                                   const WindowShape& shape, double every_s,
                                   const PipelineOptions& pipeline) {
  std::vector<NoiseWindow> windows;
  if (tracks->frames.empty()) return windows;
  checkLength(name, tracks->first_image, tracks->frames.back().t);
  const int count = windowCount(tracks->first_image, tracks->frames.back().t, every_s, shape);
  for (int window = 0; window < count; ++window)
    windows.push_back([=, options = pipeline.window](const NoiseFactors& believed) mutable {
      options.odometry.sigma_px = believed.sigma_px;
      ImuNoiseOptions noise;
      // Whatever the samples show.
      noise.gyro_noise_factor = noise.min_gyro_noise_factor = believed.gyro;
      noise.accel_noise_factor = noise.min_accel_noise_factor = believed.accel;
      return windowProblem(*tracks, every_s, shape, window, noise, options);
    });
  return windows;
}

/** The number of windows that hold one instant. */
double overlapOf(const WindowShape& shape, const CalibrateDeviceArguments& arguments) {
  return std::max(1.0, (shape.keyframes - 1) / (shape.rate_hz * arguments.every_s));
}

NoiseCalibration calibrate(const std::string& name, const std::vector<NoiseWindow>& windows,
                           const RunConfiguration& configuration,
                           const CalibrateDeviceArguments& arguments, const WindowShape& shape) {
  NoiseCalibrationOptions options;
  options.window = configuration.pipeline.window;
  options.overlap = overlapOf(shape, arguments);
  options.start = {configuration.pipeline.imu_noise.gyro_noise_factor,
                   configuration.pipeline.imu_noise.accel_noise_factor,
                   configuration.pipeline.window.odometry.sigma_px};
  if (arguments.include_rest) options.min_speed_mps = 0.0;
  ProgressLine line;
  options.progress = [&](size_t done, size_t all) {
    line.update(false, [&] {
      return "calibrate-device: " + name + ": window " + std::to_string(done) + "/" +
             std::to_string(all);
    });
  };
  NoiseCalibration calibration =
      calibrateNoise(windows, *configuration.initializers.initializer, options);
  line.interrupt();
  return calibration;
}

/** Keyframes apart as configured, and twice as far. */
struct BothIntervals {
  WindowShape shape;
  std::vector<NoiseWindow> windows;
};

/** Writes what the noise's calibrations determine. */
void setNoise(const NoiseCalibration& shorter, const NoiseCalibration& longer,
              const WindowShape& shape, double density, const RunConfiguration& configuration,
              size_t recordings, DeviceFile* file) {
  for (const char* key : {"gyro_noise_factor", "accel_noise_factor"}) file->unset("imu_noise", key);
  for (const char* key : {"slow_accel_mps2", "slow_accel_s"}) file->unset("priors", key);
  const double interval_s = 1.0 / shape.rate_hz;
  std::string from = format("%zu of %d windows of %s; factors at %.2g and %.2g s",
                            shorter.checks.size(), shorter.windows,
                            counted(recordings, "recording").c_str(), interval_s, 2.0 * interval_s);
  const auto describe = [&from](const char* what, double at_shorter, double sigma_shorter,
                                double at_longer, double sigma_longer) {
    from += format("; %s %.2f +- %.0f %% and %.2f +- %.0f %%", what, at_shorter,
                   100.0 * sigma_shorter, at_longer, 100.0 * sigma_longer);
  };
  describe("gyro", shorter.factors.gyro, shorter.relative_sigma.gyro, longer.factors.gyro,
           longer.relative_sigma.gyro);
  describe("accelerometer", shorter.factors.accel, shorter.relative_sigma.accel,
           longer.factors.accel, longer.relative_sigma.accel);
  if (!hardlyDetermined(shorter.relative_sigma.gyro))
    file->set("imu_noise", "gyro_noise_factor", format("%.3g", shorter.factors.gyro));
  else
    from += "; the gyro's is hardly determined and left out";
  if (!hardlyDetermined(shorter.relative_sigma.accel) &&
      !hardlyDetermined(longer.relative_sigma.accel)) {
    const double time_s = configuration.pipeline.window.priors.slow_accel.time_s;
    const AccelerometerError error =
        separateSlowError({shorter.factors.accel, interval_s},
                          {longer.factors.accel, 2.0 * interval_s}, density, time_s);
    from += format("; white part %.2f, slow part %.3g m/s^2", error.white_factor, error.slow_mps2);
    file->set("imu_noise", "accel_noise_factor",
              format("%.3g", std::max(shorter.factors.accel, longer.factors.accel)));
    if (error.slow_mps2 > 0.0) {
      file->set("priors", "slow_accel_mps2", format("%.3g", error.slow_mps2));
      file->set("priors", "slow_accel_s", format("%.3g", time_s));
    }
  } else {
    from += "; the accelerometer's is hardly determined and left out";
  }
  // Errors of a track's pixels are correlated. Residuals do not show it: the noise is too small.
  from += format("; pixels %.3g px, which is too small and not used", shorter.factors.sigma_px);
  file->set("device", "noise_from", from);
}

/** Flies the recordings; where the biases are not settled the flight is left out with the reason.
 */
class Calibration {
 public:
  Calibration(const CalibrateDeviceArguments& arguments, RunState* state)
      : arguments_(arguments),
        state_(*state),
        configuration_(loadRunConfiguration(arguments.configuration.ini(),
                                            arguments.configuration.plugin_path)),
        file_(arguments.base.empty() ? DeviceFile(arguments.name)
                                     : DeviceFile::fromIni(IniFile::fromFile(arguments.base))) {
    if (!arguments.base.empty() && !arguments.name.empty())
      file_.set("device", "name", arguments.name);
    for (const std::string& recording : arguments.without) file_.remove(recording);
    // A prior that pins a bias would be found again, and its error as noise.
    BiasPriors& priors = configuration_.pipeline.window.priors;
    priors = priorsForCalibration(priors);
    configuration_.initializers.initializer =
        watched(configuration_.initializers.initializer, configuration_.initializers.name, state);
    const PipelineOptions& pipeline = configuration_.pipeline;
    intervals_[0].shape = {pipeline.keyframes, pipeline.keyframe_rate_hz};
    intervals_[1].shape = atTwiceTheInterval(intervals_[0].shape);
  }

  void add(const std::string& source) {
    const std::string name = recordingName(source);
    const auto tracks = std::make_shared<const SequenceTracks>(
        tracksOf(source, arguments_, configuration_.pipeline));
    state_.first_image = tracks->first_image;
    density_ = tracks->calibration.imu.noise.accel_noise_density;
    for (BothIntervals& interval : intervals_) {
      const std::vector<NoiseWindow> windows =
          windowsOf(source, tracks, interval.shape, arguments_.every_s, configuration_.pipeline);
      interval.windows.insert(interval.windows.end(), windows.begin(), windows.end());
    }
    std::fprintf(stderr, "calibrate-device: %s: odometry\n", name.c_str());
    const auto bias = biasOfFlight(
        flyOverTracks(*tracks, configuration_.pipeline, *configuration_.initializers.initializer),
        configuration_.pipeline.window.priors);
    if (bias) {
      std::printf("%s: %s\n", name.c_str(), describe(*bias).c_str());
      file_.put(name, *bias);
    } else {
      std::printf("%s: no biases, because %s\n", name.c_str(), bias.error().reason.c_str());
    }
    std::fflush(stdout);
  }

  void calibrateNoise() {
    const TableFormat format = tableFormatFromName(arguments_.format);
    Table table = emptyNoiseTable();
    std::vector<NoiseCalibration> found;
    for (const BothIntervals& interval : intervals_) {
      found.push_back(
          calibrate("noise", interval.windows, configuration_, arguments_, interval.shape));
      addNoiseRows("all", 1.0 / interval.shape.rate_hz, found.back(), &table);
    }
    std::fputs(table.toString(format).c_str(), stdout);
    if (format == TableFormat::kText || format == TableFormat::kMarkdown)
      for (size_t i = 0; i < found.size(); ++i)
        printNoise(etalon::format("keyframes %.2g s apart", 1.0 / intervals_[i].shape.rate_hz),
                   found[i], overlapOf(intervals_[i].shape, arguments_));
    if (found[0].checks.empty() || found[1].checks.empty()) {
      std::printf("no noise, because %s\n",
                  (found[0].checks.empty() ? found[0] : found[1]).message.c_str());
      return;
    }
    has_noise_ = true;
    setNoise(found[0], found[1], intervals_[0].shape, density_, configuration_,
             arguments_.sources.size(), &file_);
  }

  /** @throws DataError if there is nothing to write */
  void write() const {
    if (file_.flights().empty() && !has_noise_)
      throw DataError("", 0, "no recording tells biases or noise; no device file was written");
    writeFile(arguments_.out, file_.toIni());
    std::printf("\nwritten: %s, %s\n", arguments_.out.c_str(),
                counted(file_.flights().size(), "flight").c_str());
    if (file_.flights().empty())
      std::fprintf(stderr,
                   "warning: %s has no biases: no flight settled them. Fly for half a minute or "
                   "more, and turn and change the speed: the first ten seconds do not count, and "
                   "ten more are wanted\n",
                   printable(arguments_.out).c_str());
  }

 private:
  const CalibrateDeviceArguments& arguments_;
  RunState& state_;
  RunConfiguration configuration_;
  DeviceFile file_;
  BothIntervals intervals_[2];
  double density_ = 0.0;
  bool has_noise_ = false;
};

/** @throws ConfigError if the file to write is there and is something else */
void requireNoOtherFile(const std::string& out) {
  if (!std::filesystem::is_regular_file(out)) return;
  try {
    DeviceFile::fromIni(IniFile::fromFile(out));
  } catch (const Error& e) {
    throw ConfigError("calibrate-device: --out " + out +
                      " is there and is no device file, so it is not replaced: choose another "
                      "name or remove it (" +
                      e.what() + ")");
  }
}

/** What should not be noticed after minutes of work: a device file that cannot be written, and
 * recordings that tell nothing. */
void checkBeforeFlying(const CalibrateDeviceArguments& arguments) {
  requireDifferentNames(arguments.sources);
  { const OutputFile writable(arguments.out); }
  for (const std::string& source : arguments.sources)
    for (const std::string& warning : requireSoundRecording(source))
      std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
}

int calibrateDevice(const CalibrateDeviceArguments& arguments) {
  if (arguments.sources.empty() && arguments.base.empty())
    throw ConfigError("calibrate-device: expected recordings, or a device file (--base)");
  if (!arguments.without.empty() && arguments.base.empty())
    throw ConfigError("calibrate-device: --without leaves out flights of --base, which is missing");
  requireNoOtherFile(arguments.out);
  endOnSignals("calibrate-device: interrupted; nothing is written");
  const RunEnd end = runSupervised(arguments.time_limit_s, [&arguments](RunState& state) {
    checkBeforeFlying(arguments);
    Calibration calibration(arguments, &state);
    for (const std::string& source : arguments.sources) calibration.add(source);
    if (!arguments.sources.empty()) calibration.calibrateNoise();
    calibration.write();
    return static_cast<int>(kOk);
  });
  if (end.finished) return end.exit_code;
  std::fprintf(stderr, "etalon: %s; no device file was written\n",
               printable(describe(end, joined(arguments.sources))).c_str());
  return kPluginDied;
}

}  // namespace

void addCalibrateDeviceCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<CalibrateDeviceArguments>();
  CLI::App* command = app.add_subcommand(
      "calibrate-device",
      "Fly recordings of one device and write what they tell of it, without ground truth: the "
      "noise of gyro, accelerometer and pixels from the residuals of VI-BA at two intervals, and "
      "where the biases of its next flight will be. The file is used with -c after a run's own.");
  command->add_option("SRC", arguments->sources, kSourceFormats);
  command->add_option("--out", arguments->out, "Device file to write (INI)")
      ->required()
      ->check(checkOutputPath());
  command->add_option("--name", arguments->name, "Name of the device, for people");
  command
      ->add_option(
          "--base", arguments->base,
          "Device file to begin with: flights of SRC are added to its own, and their noise takes "
          "the place of its own")
      ->check(CLI::ExistingFile);
  command->add_option("--without", arguments->without, "Flight of --base to leave out; repeatable")
      ->allow_extra_args(false);
  arguments->configuration.addInitializer(command);
  command->add_option("--every", arguments->every_s, "Seconds from window to window")
      ->check(CLI::Range(0.01, 1e6, "seconds from 0.01 to 1e6"))
      ->capture_default_str();
  command->add_flag("--include-rest", arguments->include_rest,
                    "For the noise, also use windows at rest (slower than 0.1 m/s), which do not "
                    "vibrate");
  command->add_option("--tracks", arguments->tracks,
                      "Folder of cached tracks, that of a benchmark for instance (default: none)");
  command->add_option("--format", arguments->format, "How to print the table of the noise")
      ->check(CLI::IsMember({"text", "markdown", "csv"}))
      ->capture_default_str();
  arguments->configuration.addConfig(command);
  arguments->configuration.addOverrides(command);
  addTimeLimitOption(command, "Processor time that the initializer may use for a window",
                     &arguments->time_limit_s);
  command->footer(
      "Exit codes: 0 done, 2 usage or configuration, 3 data, 4 the initializer crashed, ended the "
      "process or used up its time, 130 interrupted (nothing is written).");
  command->callback([arguments, exit_code] { *exit_code = calibrateDevice(*arguments); });
}

}  // namespace etalon::app
