// etalon_predicted_errors [--windows N] [--initializer NAME]
//
// Errors of an initializer and what it predicts of them, over pixel noise, number of tracks, outliers, distance of the
// landmarks and baseline, one at a time, as tables for docs/predicted_errors.md: simulated windows, gentle and aggressive
// in turn, an IMU with the data sheet's noise, biases drawn from the priors, a problem that believes just that. Deterministic.
#include "etalon/initialization/predicted_errors.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/angles.h"
#include "etalon/core/statistics.h"
#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/window_initialization.h"
#include "etalon/simulation/track_synthesis.h"
#include "etalon/testing/program.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** What is varied. */
struct Case {
  SyntheticWindowOptions window;
  double baseline_m = 0.0;  ///< 0: EuRoC's
};

Case usual() {
  Case usual;
  usual.window.sigma_px = usual.window.assumed_sigma_px = 0.29;
  usual.window.gyro_noise_factor = usual.window.accel_noise_factor = 1.0;
  usual.window.frames_per_keyframe = 1;
  return usual;
}

SyntheticWindow makeWindow(Case what, unsigned seed) {
  SyntheticWindowOptions& options = what.window;
  options.seed = seed;
  options.motion = seed % 2 == 0 ? testing::Motion::kGentle : testing::Motion::kAggressive;
  std::mt19937 random(seed + 1'000'000);
  std::normal_distribution<double> normal;
  for (int a = 0; a < 3; ++a) {
    options.bias.gyro[a] = options.priors.sigma_gyro_rps * normal(random);
    options.bias.accel[a] = options.priors.sigma_accel_mps2 * normal(random);
  }
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  // Simulated biases do not walk.
  window.calibration.imu.noise.gyro_random_walk *= 1e-3;
  window.calibration.imu.noise.accel_random_walk *= 1e-3;
  if (!(what.baseline_m > 0.0)) return window;
  SE3 &left = window.calibration.cameras[0].T_BC, &right = window.calibration.cameras[1].T_BC;
  right.t = left.t + what.baseline_m / window.calibration.baseline() * (right.t - left.t);
  Trajectory poses;
  for (const StampedState& state : window.truth) poses.push_back({state.t, state.T_WB});
  TrackSynthesisOptions tracks;
  tracks.sigma_px = options.sigma_px;
  tracks.max_tracks = static_cast<int>(window.landmarks.size());
  tracks.border_px = 1.0;
  tracks.seed = seed;
  window.frames = simulateTracks(poses, window.calibration, window.landmarks, tracks);
  return window;
}

/** Errors of windows beside the predicted ones. */
struct Errors {
  double squares = 0.0, predicted = 0.0;  ///< sums
  int beyond = 0;                         ///< the bound at 95 %
  int count = 0;

  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
    squares += error.squaredNorm();
    predicted += covariance.trace();
    beyond += error.norm() > predictedError(covariance, 0.95).bound;
    ++count;
  }
  std::string text(int decimals, double unit) const {
    if (count == 0) return " – | – | – |";
    char text[80];
    std::snprintf(text, sizeof text, " %.*f | %.*f | %.0f |", decimals,
                  unit * std::sqrt(squares / count), decimals, unit * std::sqrt(predicted / count),
                  100.0 * beyond / count);
    return text;
  }
};

void printRow(const std::string& name, const Case& what, const Initializer& initializer,
              int windows) {
  WindowOptions options;
  options.odometry.sigma_px = what.window.assumed_sigma_px;
  // These tracks share no error.
  options.vi_ba.sigma_shared_deg = options.vi_ba.sigma_turn_deg = 1e-4;
  options.priors = what.window.priors;
  Errors tilt, velocity, gyro;
  int accepted = 0, wrong = 0;
  for (int i = 0; i < windows; ++i) {
    const SyntheticWindow window = makeWindow(what, static_cast<unsigned>(i + 1));
    const InitializationAttempt attempt =
        attemptInitialization(testing::makeProblem(window, what.window), initializer, options);
    accepted += attempt.accepted();
    if (attempt.accepted())
      wrong +=
          !testing::errorsOf(attempt.states(), attempt.bias(), window).success().value_or(true);
    if (!attempt.init || attempt.init->covariance.size() == 0) continue;
    const Eigen::VectorXd error = testing::estimationError(*attempt.init, window);
    const Eigen::MatrixXd& P = attempt.init->covariance;
    tilt.add(error.segment(6, 2), P.block(6, 6, 2, 2));
    velocity.add(error.segment(8, 3), P.block(8, 8, 3, 3));
    gyro.add(error.segment(0, 3), P.block(0, 0, 3, 3));
  }
  std::printf("| %s | %d | %d | %d |%s%s%s\n", name.c_str(), tilt.count, accepted, wrong,
              tilt.text(3, kDegreesPerRadian).c_str(), velocity.text(4, 1.0).c_str(),
              gyro.text(5, 1.0).c_str());
  std::fflush(stdout);
}

void run(const std::string& name, int windows) {
  PluginLoader loader(PluginLoader::defaultSearchPath({}));
  const Initializer::Ptr initializer = loader.create(name);
  ParameterSet parameters(name);
  initializer->declareParameters(parameters);
  if (name == "etalon")
    parameters.read(
        IniFile::fromText("[etalon]\nsigma_shared_deg = 0\nsigma_turn_deg = 0\n", "simulation"));
  const auto table = [&](const char* title, const std::vector<double>& values,
                         const std::function<void(Case*, double)>& set) {
    std::printf(
        "\n| %s | estimates of %d | accepted | wrongly | gravity, deg: rms | predicted | beyond 95 "
        "%%, %% | "
        "velocity, m/s: rms | predicted | beyond | b_g, rad/s: rms | predicted | beyond |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        title, windows);
    for (const double value : values) {
      Case what = usual();
      set(&what, value);
      char text[40];
      std::snprintf(text, sizeof text, "%g", value);
      printRow(text, what, *initializer, windows);
    }
  };
  table("pixel noise, px", {0.05, 0.1, 0.29, 0.5, 1.0},
        [](Case* c, double px) { c->window.sigma_px = c->window.assumed_sigma_px = px; });
  table("tracks", {20, 50, 100, 250},
        [](Case* c, double tracks) { c->window.landmarks = static_cast<int>(tracks); });
  table("outliers, %", {0, 5, 10, 20, 30},
        [](Case* c, double percent) { c->window.outlier_share = 0.01 * percent; });
  table("distance, m", {1, 3, 10, 30, 100, 1e6},
        [](Case* c, double metres) { c->window.landmark_distance_m = metres; });
  table("baseline, cm", {5, 11, 20, 30},
        [](Case* c, double centimetres) { c->baseline_m = 0.01 * centimetres; });
}

}  // namespace
}  // namespace etalon

int main(int argc, char** argv) {
  std::string initializer = "etalon";
  int windows = 60;
  CLI::App app("Errors of an initializer beside the predicted ones", "etalon_predicted_errors");
  app.add_option("--initializer", initializer, "Its name")->capture_default_str();
  app.add_option("--windows", windows, "Windows a row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  return etalon::testing::runProgram(&app, argc, argv, [&] { etalon::run(initializer, windows); });
}
