
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/convert.h"
#include "support/fault_option.h"
#include "support/progress_line.h"
#include "support/read_summary.h"

namespace etalon::app {

namespace {

struct ConvertArguments {
  std::string source, destination;
  bool embed = false;
  FaultOption fault;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void convert(const ConvertArguments& arguments) {
  const std::filesystem::path destination = arguments.destination;
  if (destination.extension() != ".rawlog")
    throw ConfigError("convert: expected a destination that ends in .rawlog, found '" +
                      arguments.destination + "'");
  SourceOptions source_options;
  const bool embed = arguments.embed || arguments.fault.given();
  source_options.decode_images = embed;
  source_options.check_images = true;
  source_options.imu_lead_s = std::numeric_limits<double>::infinity();
  const auto source =
      arguments.fault.apply([&] { return openSource(arguments.source, source_options); }, 0.0);

  const auto start = std::chrono::steady_clock::now();
  ProgressLine line;
  ConvertOptions options;
  options.embed = embed;
  options.progress = [&](const ConvertProgress& progress) {
    line.update(progress.frames == progress.frames_total, [&]() -> std::string {
      char text[100];
      std::snprintf(text, sizeof text, "convert: %d of %d stereo frames, %.0f a second",
                    progress.frames, progress.frames_total,
                    progress.frames / std::max(secondsSince(start), 1e-9));
      return text;
    });
  };
  const ConvertReport report = convertToRawlog(*source, arguments.destination, options);
  printReadProblems(source->statistics().unreadable_images, source->statistics().warnings);
  std::printf("%s: %d stereo frames (%s), %d IMU samples, %d ground-truth poses, %.1f MB\n",
              arguments.destination.c_str(), report.stereo_frames,
              report.embedded ? "embedded" : "external images", report.imu_samples,
              report.ground_truth_poses,
              1e-6 * static_cast<double>(std::filesystem::file_size(destination)));
}

}  // namespace

void addConvertCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand(
      "convert", "Write a recording as an MRPT rawlog (stock classes, external images).");
  command->add_option("SRC", arguments->source, "EuRoC (ASL) folder or .rawlog")->required();
  command->add_option("DST", arguments->destination, "the .rawlog to write")->required();
  command->add_flag("--embed", arguments->embed,
                    "Store the pixels in the log instead of the paths of the image files.");
  arguments->fault.add(command);
  command->footer("With faults, the pixels are stored in the log.");
  command->callback([arguments, exit_code] {
    convert(*arguments);
    *exit_code = kOk;
  });
}

}  // namespace etalon::app
