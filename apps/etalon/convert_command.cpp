
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "etalon/datasets/convert.h"
#include "options/fault_option.h"
#include "options/recording_option.h"
#include "support/new_folders.h"
#include "support/progress_line.h"
#include "support/read_summary.h"
#include "support/stop_on_signals.h"

namespace etalon::app {

namespace {

struct ConvertArguments {
  std::string source, destination;
  bool embed = false;
  FaultOption fault;
  RecordingOptions recording;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/** What is written, by the destination's name. */
struct Target {
  ConvertReport (*write)(SensorSource&, const std::string&, const ConvertOptions&);
  bool decodes;  ///< it needs the pixels
};

Target targetOf(const std::string& destination) {
  const std::string extension = std::filesystem::path(destination).extension().string();
  if (extension == ".rawlog") return {convertToRawlog, false};
  if (extension == ".bag") return {convertToRosBag, true};
  if (extension == ".db3") return {convertToRos2Bag, true};
  if (extension.empty()) return {convertToEuroc, true};
  throw ConfigError(
      "convert: expected a destination that ends in .rawlog, .bag (ROS 1) or .db3 (ROS 2), or a "
      "folder (without an extension) for EuRoC's layout, found '" +
      destination + "'");
}

/** Of a file, or of all files of a folder. */
double megabytes(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path))
    return 1e-6 * static_cast<double>(std::filesystem::file_size(path));
  double sum = 0.0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
    if (entry.is_regular_file()) sum += 1e-6 * static_cast<double>(entry.file_size());
  return sum;
}

int convert(const ConvertArguments& arguments) {
  const Target target = targetOf(arguments.destination);
  if (arguments.embed && target.decodes)
    throw ConfigError(
        "convert: --embed is for a rawlog; a folder and a bag always have the pixels");
  const bool embed = arguments.embed || arguments.fault.given();
  SourceOptions source_options;
  source_options.decode_images = embed || target.decodes;
  source_options.check_images = true;
  source_options.imu_margin_s = std::numeric_limits<double>::infinity();
  source_options.recording = arguments.recording;
  const auto source =
      arguments.fault.apply([&] { return openSource(arguments.source, source_options); }, 0.0);

  const NewFolders new_folders(std::filesystem::path(arguments.destination) / "mav0");
  const std::atomic<bool>* stop = stopOnSignals();
  const auto start = std::chrono::steady_clock::now();
  ProgressLine line;
  ConvertOptions options;
  options.embed = embed;
  options.progress = [&](const ConvertProgress& progress) {
    if (stop->load()) throw Interrupted();
    line.update(progress.frames == progress.frames_total, [&]() -> std::string {
      return format("convert: %d of %d stereo frames, %.0f a second", progress.frames,
                    progress.frames_total, progress.frames / std::max(secondsSince(start), 1e-9));
    });
  };
  ConvertReport report;
  try {
    report = target.write(*source, arguments.destination, options);
  } catch (const Interrupted& e) {
    line.interrupt();
    std::fprintf(stderr, "convert: %s; nothing is written\n", e.what());
    return kInterrupted;
  }
  printReadProblems(source->statistics().unreadable_images, source->statistics().warnings);
  if (!report.lost_truth.empty())
    std::fprintf(stderr,
                 "warning: %s: the %s of the ground truth are lost: only its poses are in\n",
                 arguments.destination.c_str(), report.lost_truth.c_str());
  std::printf("%s: %d stereo frames (%s), %d IMU samples, %d ground-truth poses, %.1f MB\n",
              arguments.destination.c_str(), report.stereo_frames,
              report.embedded ? "embedded" : "external images", report.imu_samples,
              report.ground_truth_poses, megabytes(arguments.destination));
  return kOk;
}

}  // namespace

void addConvertCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand(
      "convert",
      "Write a recording as an MRPT rawlog (stock classes, external images), a EuRoC folder or a "
      "bag of ROS 1 or ROS 2.");
  command->add_option("SRC", arguments->source, kSourceFormats)->required();
  command
      ->add_option(
          "DST", arguments->destination,
          "What to write: NAME.rawlog, a folder, NAME.bag (ROS 1) or BAG/NAME.db3 (ROS 2: the "
          "folder BAG is the bag); Kalibr's files are written beside a bag")
      ->required();
  command->add_flag("--embed", arguments->embed,
                    "Rawlog: store the pixels instead of the paths of the image files.");
  arguments->fault.add(command);
  addRecordingOptions(command, &arguments->recording);
  command->footer(
      "With faults, the pixels are stored in the rawlog; of recordings without image files it "
      "takes "
      "--embed. Exit codes: 0 done, 2 usage or configuration, 3 data, 130 interrupted (nothing is "
      "written).");
  command->callback([arguments, exit_code] { *exit_code = convert(*arguments); });
}

}  // namespace etalon::app
