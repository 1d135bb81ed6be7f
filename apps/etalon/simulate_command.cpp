
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "etalon/simulation/fisheye_rig.h"
#include "etalon/simulation/simulate_recording.h"
#include "support/checks.h"
#include "support/new_folders.h"
#include "support/progress_line.h"
#include "support/stop_on_signals.h"

namespace etalon::app {

namespace {

struct SimulateArguments {
  SimulationOptions options;
  std::string profile = "gentle";
  std::string camera = "euroc";
  double duration_s = 0.0;
};

/** Frames done, and the rate since the first call. */
class SimulationProgress {
 public:
  explicit SimulationProgress(const std::atomic<bool>* stop) : stop_(stop) {}

  /** @throws Interrupted if the simulation shall stop */
  void operator()(int done, int all) {
    if (stop_->load()) {
      line_.interrupt();
      throw Interrupted();
    }
    using std::chrono::steady_clock;
    const steady_clock::time_point now = steady_clock::now();
    if (done == 1) start_ = now;
    line_.update(done == all, [&]() -> std::string {
      const double seconds = std::chrono::duration<double>(now - start_).count();
      return format("simulate: %d/%d stereo frames, %.1f frames/s", done, all,
                    seconds > 0.0 ? (done - 1) / seconds : 0.0);
    });
  }

 private:
  const std::atomic<bool>* stop_;
  ProgressLine line_;
  std::chrono::steady_clock::time_point start_;
};

int runSimulate(SimulateArguments arguments, bool has_duration) {
  SimulationOptions& options = arguments.options;
  options.profile = motionProfileFromName(arguments.profile);
  if (arguments.camera == "fisheye") options.calibration = fisheyeCalibration();
  if (has_duration) options.duration_s = arguments.duration_s;
  const NewFolders new_folders(std::filesystem::path(options.output) / "mav0");
  options.progress = SimulationProgress(stopOnSignals());
  SimulationSummary summary;
  try {
    summary = simulateRecording(options);
  } catch (const Interrupted& e) {
    std::fprintf(stderr, "simulate: %s; nothing is written\n", e.what());
    return kInterrupted;
  }
  if (summary.skipped_stamps > 0) {
    std::cerr << "simulate: " << summary.skipped_stamps
              << " stamps skipped: outside of the ground truth or the IMU\n";
  }
  std::printf("%s: %d stereo frames, %d IMU samples, room %.1f x %.1f x %.1f m\n",
              options.output.c_str(), summary.stereo_frames, summary.imu_samples,
              summary.room_size_m[0], summary.room_size_m[1], summary.room_size_m[2]);
  return kOk;
}

void addImageOptions(CLI::App* command, RenderOptions* render) {
  command
      ->add_option("--blur", render->blur_samples,
                   "Motion blur: instants averaged over the exposure; 0: none")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  command->add_option("--exposure-ms", render->exposure_ms, "Exposure of the motion blur")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--image-noise", render->noise_gray,
                   "Standard deviation in the dark, gray levels")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command->add_option("--vignetting", render->vignetting, "Share of light lost in the corners")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
}

}  // namespace

void addSimulateCommand(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand(
      "simulate", "Write a EuRoC folder of a simulated flight in a textured room.");
  auto arguments = std::make_shared<SimulateArguments>();
  SimulationOptions& o = arguments->options;
  command->add_option("--out", o.output, "Folder to write; must be empty or not exist")
      ->check(checkOutputPath())
      ->required();
  command->add_flag("--force", o.overwrite,
                    "Overwrite the sensors' folders in a folder that is not empty");
  command->add_option("--seed", o.seed, "Of motion, biases, noise, room and textures")
      ->check(checkWholeNumber())
      ->capture_default_str();
  CLI::Option* duration = command->add_option("--duration", arguments->duration_s,
                                              "Seconds; default 30, or all of a recorded flight");
  CLI::Option* profile =
      command->add_option("--profile", arguments->profile, "Motion of the flight")
          ->check(CLI::IsMember({"static", "gentle", "aggressive", "pure-rotation"}))
          ->capture_default_str();
  command
      ->add_option(
          "--camera", arguments->camera,
          "Lenses of the rig: EuRoC's (752x480, pinhole) or fisheyes (512x512, 218 degrees)")
      ->check(CLI::IsMember({"euroc", "fisheye"}))
      ->capture_default_str();
  CLI::Option* trajectory =
      command
          ->add_option("--trajectory", o.trajectory_file,
                       "Recorded ground truth to fly (EuRoC's csv of 8 or 17 columns)")
          ->excludes(profile);
  command
      ->add_option("--imu", o.imu_file,
                   "Recorded IMU (EuRoC's csv) to copy instead of a synthetic one")
      ->needs(trajectory);
  command->add_option("--stamps", o.stamps_file, "Image stamps, one in ns a line")
      ->needs(trajectory);
  command
      ->add_option("--from", o.from_s,
                   "Images from this many seconds after the recorded flight's start")
      ->needs(trajectory);
  addImageOptions(command, &o.render);
  command->add_flag("--noise-free", o.noise_free, "No noise and no biases, in IMU and images");
  command
      ->add_option(
          "--threads", o.threads,
          "Threads that render; 0: as many as there are processors. The result is the same")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  command->footer(
      "Exit codes: 0 done, 2 usage or configuration, 3 data, 130 interrupted (nothing is "
      "written).");
  command->callback([arguments, duration, exit_code] {
    *exit_code = runSimulate(*arguments, duration->count() > 0);
  });
}

}  // namespace etalon::app
