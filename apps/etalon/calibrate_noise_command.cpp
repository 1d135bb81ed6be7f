#include <algorithm>
#include <cstdio>
#include <memory>

#include "commands.h"
#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/noise_calibration.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/report/comparison_table.h"
#include "support/checks.h"
#include "support/configuration_options.h"
#include "support/progress_line.h"

namespace etalon::app {

namespace {

struct Arguments {
  std::vector<std::string> sources;
  std::string out, tracks, format = "text";
  ConfigurationOptions configuration;
  double every_s = 2.5;
  bool include_rest = false;
};

/** Tracks of a recording; with --tracks from that folder, where they fit. */
SequenceTracks tracksOf(const std::string& source, const Arguments& arguments,
                        const PipelineOptions& pipeline) {
  const auto recording = openRecording(source);
  ProgressLine line;
  TrackingOptions tracking;
  tracking.frontend = pipeline.frontend;
  tracking.gyro_bias = pipeline.window.priors.mean.gyro;
  tracking.decode_ahead = true;
  tracking.progress = [&](size_t done, size_t all) {
    line.update(done == all, [&] {
      return "calibrate-noise: " + recordingName(source) + ": front end " + std::to_string(done) +
             "/" + std::to_string(all) + " frames";
    });
  };
  if (arguments.tracks.empty()) return trackSequence(*recording, tracking);
  return loadOrTrack(*recording, recordingHash(*recording), recordingName(source), arguments.tracks,
                     tracking, nullptr);
}

/** The windows of the recording `name`. */
std::vector<NoiseWindow> windowsOf(const std::string& name,
                                   const std::shared_ptr<const SequenceTracks>& tracks,
                                   double every_s, const PipelineOptions& pipeline) {
  std::vector<NoiseWindow> windows;
  if (tracks->frames.empty()) return windows;
  checkLength(name, tracks->first_image, tracks->frames.back().t);
  const WindowShape shape{pipeline.keyframes, pipeline.keyframe_rate_hz};
  const int count = windowCount(tracks->first_image, tracks->frames.back().t, every_s, shape);
  for (int window = 0; window < count; ++window)
    windows.push_back([=, options = pipeline.window](const NoiseFactors& believed) mutable {
      options.priors = priorsForCalibration(options.priors);
      options.odometry.sigma_px = believed.sigma_px;
      ImuNoiseOptions noise;
      noise.gyro_noise_factor = believed.gyro;
      noise.accel_noise_factor = noise.min_accel_noise_factor =
          believed.accel;  // whatever the samples show
      return windowProblem(*tracks, every_s, shape, window, noise, options);
    });
  return windows;
}

Table emptyTable() {
  return Table({{"recording", "recording"},
                {"iteration", "iteration"},
                {"windows", "windows used", true},
                {"offered", "of", true},
                {"at_rest", "at rest", true},
                {"failed", "failed", true},
                {"gyro_noise_factor", "gyro factor", true, 2},
                {"gyro_sigma", "+- [%]", true, 0, 100.0},
                {"accel_noise_factor", "accel. factor", true, 2},
                {"accel_sigma", "+- [%]", true, 0, 100.0},
                {"sigma_px", "sigma_px", true, 3},
                {"sigma_px_sigma", "+- [%]", true, 1, 100.0},
                {"chi2_gyro", "chi2/dof gyro", true, 2},
                {"chi2_accel", "accel.", true, 2},
                {"chi2_vision", "vision", true, 2}});
}

void setFactors(const NoiseFactors& factors, Table* table) {
  table->setNumber("gyro_noise_factor", factors.gyro);
  table->setNumber("accel_noise_factor", factors.accel);
  table->setNumber("sigma_px", factors.sigma_px);
}

void addRows(const std::string& name, const NoiseCalibration& calibration, Table* table) {
  for (size_t i = 0; i < calibration.iterations.size(); ++i) {
    const NoiseIteration& iteration = calibration.iterations[i];
    table->addRow();
    table->setText("recording", name);
    table->setText("iteration", std::to_string(i + 1));
    table->setNumber("windows", iteration.windows);
    setFactors(iteration.believed, table);
    const NoiseCheck& c = iteration.check;
    table->setNumber("chi2_gyro", c.gyro.chi2 / c.gyro.dof);
    table->setNumber("chi2_accel", c.accel.chi2 / c.accel.dof);
    table->setNumber("chi2_vision", c.vision.chi2 / c.vision.dof);
  }
  table->addRow();
  table->setText("recording", name);
  table->setText("iteration", calibration.converged ? "result" : "not converged");
  if (!calibration.iterations.empty())
    table->setNumber("windows", calibration.iterations.back().windows);
  table->setNumber("offered", calibration.windows);
  table->setNumber("at_rest", calibration.at_rest);
  table->setNumber("failed", calibration.failed);
  setFactors(calibration.factors, table);
  table->setNumber("gyro_sigma", calibration.relative_sigma.gyro);
  table->setNumber("accel_sigma", calibration.relative_sigma.accel);
  table->setNumber("sigma_px_sigma", calibration.relative_sigma.sigma_px);
}

/** Says in words how good the noise in use and the estimate are. */
void printWords(const std::string& name, const NoiseCalibration& calibration, double overlap) {
  std::printf("\n%s\n", name.c_str());
  if (!calibration.message.empty()) std::printf("  %s\n", calibration.message.c_str());
  if (calibration.iterations.empty() || calibration.iterations.front().windows == 0) return;
  std::printf("  with the factors as configured, alike in all windows:\n");
  for (const std::string& sentence : describe(calibration.iterations.front().check, overlap))
    std::printf("    %s\n", sentence.c_str());
  constexpr double kHardly = 0.25;
  if (calibration.relative_sigma.gyro > kHardly)
    std::printf("  the gyro's factor is hardly determined: +- %.0f %%\n",
                100.0 * calibration.relative_sigma.gyro);
  if (calibration.relative_sigma.accel > kHardly)
    std::printf("  the accelerometer's factor is hardly determined: +- %.0f %%\n",
                100.0 * calibration.relative_sigma.accel);
}

/** The number of windows that hold one instant. */
double overlapOf(const PipelineOptions& pipeline, const Arguments& arguments) {
  return std::max(1.0, (pipeline.keyframes - 1) / (pipeline.keyframe_rate_hz * arguments.every_s));
}

NoiseCalibration calibrate(const std::string& name, const std::vector<NoiseWindow>& windows,
                           const RunConfiguration& configuration, const Arguments& arguments) {
  NoiseCalibrationOptions options;
  options.window = configuration.pipeline.window;
  options.window.priors = priorsForCalibration(options.window.priors);
  options.overlap = overlapOf(configuration.pipeline, arguments);
  options.start = {configuration.pipeline.imu_noise.gyro_noise_factor,
                   configuration.pipeline.imu_noise.accel_noise_factor,
                   configuration.pipeline.window.odometry.sigma_px};
  if (arguments.include_rest) options.min_speed_mps = 0.0;
  ProgressLine line;
  options.progress = [&](size_t done, size_t all) {
    line.update(false, [&] {
      return "calibrate-noise: " + name + ": window " + std::to_string(done) + "/" +
             std::to_string(all);
    });
  };
  NoiseCalibration calibration =
      calibrateNoise(windows, *configuration.initializers.initializer, options);
  line.interrupt();
  return calibration;
}

std::vector<std::string> commentOf(const Arguments& arguments,
                                   const NoiseCalibration& calibration) {
  std::vector<std::string> comment{"Noise as the residuals tell (etalon calibrate-noise), from"};
  for (const std::string& source : arguments.sources)
    comment.push_back("  " + recordingName(source));
  char text[200];
  std::snprintf(text, sizeof text,
                "%zu of %d windows; relative standard errors: gyro %.2g, accelerometer %.2g, "
                "sigma_px %.2g",
                calibration.checks.size(), calibration.windows, calibration.relative_sigma.gyro,
                calibration.relative_sigma.accel, calibration.relative_sigma.sigma_px);
  comment.emplace_back(text);
  if (!calibration.message.empty()) comment.push_back(calibration.message);
  return comment;
}

int calibrateNoise(const Arguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  const RunConfiguration configuration =
      loadRunConfiguration(arguments.configuration.ini(), arguments.configuration.plugin_path);
  std::vector<std::pair<std::string, NoiseCalibration>> results;
  std::vector<NoiseWindow> all;
  for (const std::string& source : arguments.sources) {
    const auto tracks =
        std::make_shared<const SequenceTracks>(tracksOf(source, arguments, configuration.pipeline));
    const std::vector<NoiseWindow> windows =
        windowsOf(source, tracks, arguments.every_s, configuration.pipeline);
    results.emplace_back(recordingName(source),
                         calibrate(recordingName(source), windows, configuration, arguments));
    all.insert(all.end(), windows.begin(), windows.end());
  }
  if (arguments.sources.size() > 1)
    results.emplace_back("all", calibrate("all", all, configuration, arguments));
  Table table = emptyTable();
  for (const auto& [name, calibration] : results) addRows(name, calibration, &table);
  std::fputs(table.toString(format).c_str(), stdout);
  if (format == TableFormat::kText || format == TableFormat::kMarkdown)
    for (const auto& [name, calibration] : results)
      printWords(name, calibration, overlapOf(configuration.pipeline, arguments));
  const NoiseCalibration& pooled = results.back().second;
  if (pooled.checks.empty()) throw DataError("", 0, pooled.message);
  const std::string ini = toIni(pooled.factors, commentOf(arguments, pooled));
  if (arguments.out.empty())
    std::printf("\n%s", ini.c_str());
  else
    writeFile(arguments.out, ini);
  return kOk;
}

}  // namespace

void addCalibrateNoiseCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "calibrate-noise",
      "Estimate the noise of gyro, accelerometer and pixels from the residuals of VI-BA over the "
      "windows of recordings, without ground truth. Prints the iterations, what the noise in use "
      "is worth, and the lines of an INI file for -c.");
  command->add_option("SRC", arguments->sources, "EuRoC folders and .rawlog files")->required();
  arguments->configuration.addInitializer(command);
  command->add_option("--every", arguments->every_s, "Seconds from window to window")
      ->check(CLI::Range(0.01, 1e6, "seconds from 0.01 to 1e6"))
      ->capture_default_str();
  command->add_flag("--include-rest", arguments->include_rest,
                    "Also use windows at rest (slower than 0.1 m/s), which do not vibrate");
  command->add_option("--out", arguments->out, "File for the INI lines (default: standard output)")
      ->check(checkOutputPath());
  command->add_option("--tracks", arguments->tracks,
                      "Folder of cached tracks, that of a benchmark for instance (default: none)");
  command->add_option("--format", arguments->format, "How to print the table")
      ->check(CLI::IsMember({"text", "markdown", "csv"}))
      ->capture_default_str();
  arguments->configuration.addConfig(command);
  arguments->configuration.addOverrides(command);
  command->footer("Exit codes: 0 done, 2 usage or configuration, 3 data.");
  command->callback([arguments, exit_code] { *exit_code = calibrateNoise(*arguments); });
}

}  // namespace etalon::app
