// etalon_pixel_noise [--every S] [--pixels PX,PX...] GROUND_TRUTH.csv...
//
// Errors of all initializers over the noise of the pixels, before and after VI-BA, as a table for
// docs/pixel_noise.md: flights along recorded ground truths (EuRoC's 8 or 17 columns), an IMU with
// the data sheet's noise and biases as EuRoC's, ideal tracks with white noise of so many pixels,
// and a problem that believes just that. Windows of 10 keyframes at 4 Hz, one every S seconds (10);
// those at rest are left out. Deterministic.
#include <algorithm>
#include <cstdio>
#include <map>
#include <string>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/datasets/euroc_files.h"
#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/window_initialization.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/recorded_trajectory.h"
#include "etalon/simulation/track_synthesis.h"
#include "etalon/testing/program.h"

namespace etalon {
namespace {

constexpr int kKeyframes = 10;
constexpr double kKeyframeRate = 4.0;  // Hz
constexpr double kAtRest = 0.05;       // m/s: no keyframe of the window is faster
constexpr const char* kInitializers[] = {"eta",
                                         "orbslam3_inertial_only",
                                         "stereo_nec",
                                         "vi_orb",
                                         "edi",
                                         "huang_stereo",
                                         "kneip",
                                         "vins_alignment",
                                         "drt",
                                         "joint_mle",
                                         "joint_closed_form",
                                         "etalon"};

/** A recorded flight with an IMU of its own. */
class Flight {
 public:
  Flight(const std::string& path, std::uint64_t seed)
      : trajectory_(readGroundTruthCsv(path)), seed_(seed) {
    calibration_ = testing::eurocCalibration();
    ImuSynthesisOptions options;
    options.noise = calibration_.imu.noise;
    options.initial_bias = randomImuBias(seed);
    options.seed = seed;
    SyntheticImu imu = synthesizeImu(trajectory_, trajectory_.start(), trajectory_.end(), options);
    biases_ = std::move(imu.biases);
    imu_ = ImuBuffer(std::move(imu.samples));
    landmarks_ = scatterLandmarks(trajectory_, 3000, seed);
  }

  /** Starts of windows in motion, every `every_s` seconds. */
  std::vector<TimeNs> windows(double every_s) const {
    std::vector<TimeNs> result;
    for (TimeNs t = trajectory_.start();
         t + durationNs(kKeyframes / kKeyframeRate) < trajectory_.end(); t += durationNs(every_s)) {
      double fastest = 0.0;
      for (const TimeNs stamp : stamps(t))
        fastest = std::max(fastest, trajectory_.at(stamp).v_WB.norm());
      if (fastest > kAtRest) result.push_back(t);
    }
    return result;
  }

  testing::SyntheticWindow window(TimeNs start, double sigma_px) const {
    testing::SyntheticWindow window;
    window.calibration = calibration_;
    const std::vector<TimeNs> at = stamps(start);
    TrackSynthesisOptions options;
    options.sigma_px = sigma_px;
    options.seed = seed_ + static_cast<std::uint64_t>(start);
    window.frames = simulateTracks(posesAt(trajectory_, at), calibration_, landmarks_, options);
    for (const TimeNs t : at) {
      const TrajectoryState state = trajectory_.at(t);
      window.keyframe_indices.push_back(window.truth.size());
      window.truth.emplace_back(t, state.T_WB, state.v_WB);
    }
    window.imu = ImuBuffer(imu_.between(at.front(), at.back()));
    const auto after = std::lower_bound(imu_.samples().begin(), imu_.samples().end(), at.back(),
                                        [](const ImuSample& s, TimeNs t) { return s.t < t; });
    window.bias =
        biases_[std::min(biases_.size() - 1, static_cast<size_t>(after - imu_.samples().begin()))];
    return window;
  }

 private:
  static std::vector<TimeNs> stamps(TimeNs start) {
    std::vector<TimeNs> result;
    for (int k = 0; k < kKeyframes; ++k) result.push_back(stampAtRate(start, kKeyframeRate, k));
    return result;
  }

  SplineTrajectory trajectory_;
  std::uint64_t seed_;
  StereoInertialCalibration calibration_;
  ImuBuffer imu_;
  std::vector<ImuBias> biases_;
  std::vector<Eigen::Vector3d> landmarks_;
};

/** Errors of the windows that were not refused. */
struct Column {
  std::vector<double> velocity, gravity, rre, ate;
  int refused = 0;

  void add(const testing::WindowErrors& e) {
    velocity.push_back(e.velocity_mps);
    gravity.push_back(e.gravity_deg);
    rre.push_back(e.rre_deg);
    ate.push_back(e.ate_m);
  }
  void print() const {
    std::printf(" %d | %.4f | %.2f | %.4f | %.2f |", refused, median(velocity), median(gravity),
                median(rre), 1e3 * median(ate));
  }
};

void attempt(const testing::SyntheticWindow& window, const testing::SyntheticWindowOptions& options,
             const Initializer& initializer, Column* before, Column* after) {
  WindowOptions window_options;
  window_options.odometry.sigma_px = options.assumed_sigma_px;
  // These tracks share no error.
  window_options.vi_ba.sigma_shared_deg = window_options.vi_ba.sigma_turn_deg = 1e-4;
  const InitializationProblem problem = testing::makeProblem(window, options);
  const InitializationAttempt result = attemptInitialization(problem, initializer, window_options);
  if (result.init)
    before->add(testing::errorsOf(result.init->states, result.init->bias, window));
  else
    ++before->refused;
  if (!result.accepted()) {
    ++after->refused;
    return;
  }
  std::vector<StampedState> states;
  for (size_t k = 0; k < result.vi_ba.states.size(); ++k)
    states.emplace_back(result.keyframes[k], result.vi_ba.states[k]);
  after->add(testing::errorsOf(states, result.vi_ba.bias, window));
}

void run(const std::vector<std::string>& files, double every_s, const std::vector<double>& pixels) {
  std::vector<Flight> flights;
  for (const std::string& file : files) flights.emplace_back(file, 1 + flights.size());
  PluginLoader loader(PluginLoader::defaultSearchPath({}));
  std::vector<Initializer::Ptr> initializers;
  for (const char* name : kInitializers) {
    initializers.push_back(loader.create(name));
    ParameterSet parameters(name);
    initializers.back()->declareParameters(parameters);
  }
  for (const double sigma_px : pixels) {
    std::vector<Column> before(initializers.size()), after(initializers.size());
    int count = 0;
    testing::SyntheticWindowOptions options;
    options.assumed_sigma_px = sigma_px;
    for (const Flight& flight : flights)
      for (const TimeNs start : flight.windows(every_s)) {
        const testing::SyntheticWindow window = flight.window(start, sigma_px);
        ++count;
        for (size_t i = 0; i < initializers.size(); ++i)
          attempt(window, options, *initializers[i], &before[i], &after[i]);
      }
    std::printf("\n%g px, %d windows of %zu flights\n\n", sigma_px, count, flights.size());
    std::printf(
        "| | before VI-BA: refused | v, m/s | gravity, deg | RRE, deg | ATE, mm | after: "
        "refused | v, m/s | gravity, deg | RRE, deg | ATE, mm |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < initializers.size(); ++i) {
      std::printf("| `%s` |", kInitializers[i]);
      before[i].print();
      after[i].print();
      std::printf("\n");
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace etalon

int main(int argc, char** argv) {
  std::vector<std::string> files;
  std::vector<double> pixels{0.05, 0.2, 0.5, 1.0};
  double every_s = 10.0;
  CLI::App app("Errors of all initializers over the noise of the pixels", "etalon_pixel_noise");
  app.add_option("GROUND_TRUTH", files, "EuRoC's csv of 8 or 17 columns")->required();
  app.add_option("--every", every_s, "Seconds from window to window")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--pixels", pixels, "Standard deviations, px")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  return etalon::testing::runProgram(&app, argc, argv,
                                     [&] { etalon::run(files, every_s, pixels); });
}
