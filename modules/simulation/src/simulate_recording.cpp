#include "etalon/simulation/simulate_recording.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/datasets/euroc_files.h"
#include "etalon/datasets/euroc_folder.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/integrated_trajectory.h"
#include "etalon/simulation/recorded_trajectory.h"
#include "etalon/simulation/room.h"

namespace etalon {

namespace {

constexpr double kDefaultDuration = 30.0;     // s
constexpr double kLongestDuration = 86400.0;  // s
constexpr double kImuLead = 0.1;              // s of IMU before the first image
constexpr double kImuTail = 0.05;             // s of IMU after the last image

/** Everything that is written except the images. */
struct Flight {
  std::unique_ptr<SimulatedTrajectory> trajectory;
  std::vector<TimeNs> image_stamps;
  int skipped_stamps = 0;
  int imu_samples = 0;
  SyntheticImu imu;  // empty if the IMU is copied
};

void check(const SimulationOptions& options) {
  if (options.output.empty()) throw ConfigError("a simulation needs an output folder");
  if (options.trajectory_file.empty() &&
      !(options.imu_file.empty() && options.stamps_file.empty() && options.from_s == 0.0)) {
    throw ConfigError(
        "a recorded IMU, image stamps and a start time belong to a recorded trajectory, and none "
        "was given");
  }
  if (options.duration_s &&
      !(*options.duration_s > 0.0 && *options.duration_s <= kLongestDuration)) {
    throw ConfigError("a simulation's duration must be more than 0 s and at most 86400 s");
  }
  if (!(options.from_s >= 0.0 && options.from_s < 1e9)) {
    throw ConfigError("a simulation's start time must be at least 0 s");
  }
  const auto usable = [](double rate) { return rate > 0.0 && rate <= 1e5; };
  const StereoInertialCalibration& c = options.calibration;
  if (!usable(c.imu.rate_hz) || !usable(c.cameras[0].rate_hz)) {
    throw ConfigError("a simulation needs IMU and camera rates of more than 0 Hz");
  }
  if (!(options.gravity >= 0.0 && options.gravity < 1e3)) {
    throw ConfigError("a simulation's gravity must be at least 0 m/s^2");
  }
}

ImuSynthesisOptions imuOptions(const SimulationOptions& options) {
  ImuSynthesisOptions imu;
  imu.rate_hz = options.calibration.imu.rate_hz;
  imu.gravity = options.gravity;
  imu.noise = options.calibration.imu.noise;
  imu.seed = options.seed;
  imu.white_noise = imu.bias_walk = !options.noise_free;
  if (!options.noise_free) imu.initial_bias = randomImuBias(options.seed);
  return imu;
}

Flight profileFlight(const SimulationOptions& options) {
  ProfileOptions profile;
  profile.profile = options.profile;
  profile.seed = options.seed;
  const double duration = options.duration_s.value_or(kDefaultDuration);
  profile.duration_s = kImuLead + duration + kImuTail;
  Flight flight;
  auto smooth = std::make_unique<ProfileTrajectory>(profile);
  const double rate_hz = options.calibration.cameras[0].rate_hz;
  const TimeNs first = smooth->start() + durationNs(kImuLead);
  const auto count = static_cast<std::int64_t>(std::ceil(duration * rate_hz - 1e-6));
  for (std::int64_t k = 0; k < count; ++k) {
    flight.image_stamps.push_back(stampAtRate(first, rate_hz, k));
  }
  if (options.noise_free) {
    flight.trajectory = std::make_unique<IntegratedTrajectory>(
        *smooth, options.calibration.imu.rate_hz, options.gravity);
  } else {
    flight.trajectory = std::move(smooth);
  }
  flight.imu = synthesizeImu(*flight.trajectory, flight.trajectory->start(),
                             flight.trajectory->end(), imuOptions(options));
  flight.imu_samples = flight.imu.samples.size();
  return flight;
}

/** The stamps in the file, or stamps at the camera's rate. */
std::vector<TimeNs> wantedStamps(const SimulationOptions& options, TimeNs start, TimeNs end) {
  if (!options.stamps_file.empty()) return readStamps(options.stamps_file);
  std::vector<TimeNs> stamps;
  const TimeNs first = start + durationNs(std::max(options.from_s, kImuLead));
  for (std::int64_t k = 0;; ++k) {
    const TimeNs t = stampAtRate(first, options.calibration.cameras[0].rate_hz, k);
    if (t > end) return stamps;
    stamps.push_back(t);
  }
}

Flight recordedFlight(const SimulationOptions& options) {
  const GroundTruth truth = readGroundTruthCsv(options.trajectory_file, 2);
  const TimeNs start = truth.states.front().t;
  if (secondsBetween(start, truth.states.back().t) > kLongestDuration)
    throw DataError(options.trajectory_file, 0,
                    "the first and the last stamp are more than a day apart; is one damaged?");
  TimeNs imu_start = start, imu_end = truth.states.back().t;
  Flight flight;
  if (options.imu_file.empty()) {
    flight.trajectory = std::make_unique<SplineTrajectory>(truth);
    ImuSynthesisOptions imu = imuOptions(options);
    if (truth.has_biases && !options.noise_free) {
      imu.recorded_bias = [&truth](TimeNs t) {
        return truth.at(t, std::numeric_limits<double>::max()).value().bias;
      };
    }
    flight.imu = synthesizeImu(*flight.trajectory, imu_start, imu_end, imu);
    flight.imu_samples = flight.imu.samples.size();
    imu_end = flight.imu.samples.back().t;
  } else {
    flight.trajectory = std::make_unique<InterpolatedTrajectory>(truth);
    const std::vector<ImuSample> samples = readImuCsv(options.imu_file);
    flight.imu_samples = samples.size();
    imu_start = samples.front().t;
    imu_end = samples.back().t;
  }
  const TimeNs from = start + durationNs(options.from_s);
  std::optional<TimeNs> to;
  for (TimeNs t : wantedStamps(options, start, truth.states.back().t)) {
    if (to && t >= *to) break;
    if (t >= start && t < from) continue;
    if (t < imu_start || t > imu_end || !truth.at(t)) {
      ++flight.skipped_stamps;
      continue;
    }
    if (!to && options.duration_s) to = t + durationNs(*options.duration_s);
    flight.image_stamps.push_back(t);
  }
  if (flight.image_stamps.empty()) {
    const bool file = !options.stamps_file.empty();
    throw DataError(file ? options.stamps_file : options.trajectory_file, 0,
                    "no image lies inside the recorded flight, its IMU and the time asked for; the "
                    "flight lasts from " +
                        std::to_string(start) + " to " + std::to_string(truth.states.back().t));
  }
  return flight;
}

std::vector<StampedState> truthOf(const Flight& flight) {
  std::vector<StampedState> states;
  for (size_t k = 0; k < flight.imu.samples.size(); ++k) {
    const TrajectoryState state = flight.trajectory->at(flight.imu.samples[k].t);
    states.emplace_back(state.t, state.T_WB, state.v_WB, flight.imu.biases[k]);
  }
  return states;
}

/** Frames are shared out among the threads one by one; each is drawn by one thread alone. */
void renderAll(const Flight& flight, const StereoRenderer& renderer, const EurocFolder& folder,
               const SimulationOptions& options) {
  const size_t count = flight.image_stamps.size();
  const unsigned wanted = options.threads > 0 ? static_cast<unsigned>(options.threads)
                                              : std::max(1u, std::thread::hardware_concurrency());
  const size_t threads = std::min<size_t>(wanted, count);
  std::atomic<size_t> next{0};
  std::mutex mutex;
  int done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (size_t i = next++; i < count; i = next++) {
        const TimeNs t = flight.image_stamps[i];
        for (size_t camera = 0; camera < 2; ++camera) {
          folder.writeImage(camera, t, renderer.render(camera, *flight.trajectory, t));
        }
        const std::lock_guard<std::mutex> lock(mutex);
        ++done;
        if (options.progress) options.progress(done, count);
      }
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> pool;
  try {
    pool.reserve(threads);
    for (size_t i = 1; i < threads; ++i) pool.emplace_back(work);
  } catch (const std::exception&) {  // no more threads can be made: these must do
  }
  work();
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

SimulationSummary simulateRecording(const SimulationOptions& options) {
  check(options);
  const bool recorded = !options.trajectory_file.empty();
  const Flight flight = recorded ? recordedFlight(options) : profileFlight(options);

  RoomOptions room_options;
  room_options.seed = options.seed;
  const Room room = makeRoom(*flight.trajectory, room_options);
  RenderOptions render = options.render;
  render.seed = options.seed;
  if (options.noise_free) render.noise_gray = render.shot_noise = 0.0;
  const StereoRenderer renderer(room, options.calibration, render);

  EurocFolder folder(options.output, options.overwrite);
  folder.writeCalibration(options.calibration,
                          "simulated by etalon, seed " + std::to_string(options.seed));
  if (options.imu_file.empty()) {
    folder.writeImu(flight.imu.samples);
    folder.writeGroundTruth(truthOf(flight));
  } else {
    folder.copyImu(options.imu_file);
    folder.copyGroundTruth(options.trajectory_file);
  }
  folder.writeImageLists(flight.image_stamps);
  renderAll(flight, renderer, folder, options);
  folder.complete();

  SimulationSummary summary;
  summary.stereo_frames = flight.image_stamps.size();
  summary.imu_samples = flight.imu_samples;
  summary.skipped_stamps = flight.skipped_stamps;
  for (int k = 0; k < 3; ++k) summary.room_size_m[k] = room.high[k] - room.low[k];
  return summary;
}

}  // namespace etalon
