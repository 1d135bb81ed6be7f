// observations_to_states LOG.rawlog [live]
//
// Feeds the odometry with MRPT observations, here those of a rawlog, and prints where the platform
// is once a second. A sensor driver does the same from its own thread. With `live` front end and
// estimator have threads of their own, and what is late is dropped.

#include <mrpt/obs/CRawlog.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/pipeline/run_configuration.h"

int main(int argc, char** argv) {
  using namespace etalon;
  const bool live = argc == 3 && std::string(argv[2]) == "live";
  if (argc != (live ? 3 : 2))
    return std::fprintf(stderr, "usage: observations_to_states LOG.rawlog [live]\n"), 2;
  try {
    const std::filesystem::path path = argv[1];
    if (!std::filesystem::is_regular_file(path))
      throw DataError(path.string(), 0,
                      "is no file; expected a rawlog (`etalon convert` makes one of a folder)");
    const StereoInertialCalibration calibration = openRecording(path.string())->calibration();

    RunConfiguration run =
        loadRunConfiguration(IniFile(), {});  // the defaults; or IniFile::fromFile
    run.pipeline.live = live;
    Pipeline odometry(calibration, run.pipeline, run.initializers);

    TimeNs printed = 0;
    odometry.onFrame([&printed](const FrameEstimate& estimate) {
      if (estimate.t - printed < kNanosecondsPerSecond) return;
      printed = estimate.t;
      const Eigen::Vector3d& p = estimate.nav.T_WB.t;
      std::printf("%.3f %s %.3f %.3f %.3f\n", 1e-9 * static_cast<double>(estimate.t),
                  toString(estimate.state), p.x(), p.y(), p.z());
    });
    // Between two frames the IMU goes on, at its own rate: what a controller wants.
    TimeNs known_until = 0;
    odometry.onImuState([&known_until](const ImuRateState& state) { known_until = state.t; });

    // Of images that the log refers to by relative paths.
    mrpt::img::CImage::setImagesPathBase(std::filesystem::absolute(path).parent_path().string());
    mrpt::obs::CRawlog log;
    if (!log.loadFromRawLogFile(path.string())) throw DataError(path.string(), 0, "no rawlog");
    for (const auto& entry : log)
      if (const auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(entry))
        odometry.process(*observation);
    odometry.finish();

    for (const PipelineEvent& event : odometry.events())
      std::printf("%s: %s\n", toString(event.state), event.reason.c_str());
    for (const auto& [fault, count] : odometry.inputFaults())
      std::printf("%s\n", describe(fault, count).c_str());
    std::printf("%zu frames, states to %.3f s\n", odometry.estimates().size(),
                1e-9 * static_cast<double>(known_until));
    return odometry.initializedAt() ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 3;
  }
}
