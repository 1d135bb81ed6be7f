// Time of the stages of one attempt on a window of ten keyframes, noisy tracks of 0.5 px, about 250
// landmarks a frame.
//   build with -DETALON_BUILD_BENCHMARKS=ON, then: taskset -c 0
//   build/release/bin/etalon_initialization_benchmark
#include <benchmark/benchmark.h>

#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/window_initialization.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

testing::SyntheticWindowOptions noisyWindow() {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.landmarks = 160;  // walls all around: about 250 in view
  options.sigma_px = options.assumed_sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.bias = {{0.02, -0.06, 0.04}, {0.05, -0.04, 0.03}};
  return options;
}

void visualOdometry(benchmark::State& state) {
  const auto options = noisyWindow();
  const auto window = testing::makeSyntheticWindow(options);
  for (auto _ : state) {
    const InitializationProblem problem = makeProblem(window, options);
    benchmark::DoNotOptimize(problem.visualSolution());
  }
}

void initialize(benchmark::State& state, const std::string& name) {
  PluginLoader loader({ETALON_INITIALIZERS});
  const Initializer::Ptr initializer = loader.create(name);
  ParameterSet parameters(name);
  initializer->declareParameters(parameters);
  const auto options = noisyWindow();
  const InitializationProblem problem = makeProblem(testing::makeSyntheticWindow(options), options);
  problem.visualSolution();  // stereo odometry is not the initializer's
  for (auto _ : state) benchmark::DoNotOptimize(initializer->initialize(problem));
}

void visualInertialBa(benchmark::State& state) {
  PluginLoader loader({ETALON_INITIALIZERS});
  const Initializer::Ptr initializer = loader.create("eta");
  const auto options = noisyWindow();
  const InitializationProblem problem = makeProblem(testing::makeSyntheticWindow(options), options);
  const Initialization result = initializer->initialize(problem).value();
  for (auto _ : state) benchmark::DoNotOptimize(refine(problem, result, WindowOptions(), nullptr));
}

BENCHMARK(visualOdometry)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(initialize, orbslam3_inertial_only, std::string("orbslam3_inertial_only"))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(initialize, etalon, std::string("etalon"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(initialize, eta, std::string("eta"))->Unit(benchmark::kMillisecond);
BENCHMARK(visualInertialBa)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace etalon
