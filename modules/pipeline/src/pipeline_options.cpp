#include "etalon/pipeline/pipeline_options.h"

#include "kept_samples.h"
#include "odometry_kinds.h"

namespace etalon {

namespace {

ParameterSet pipelineSection(PipelineOptions* options) {
  ParameterSet pipeline("pipeline");
  pipeline.add("initializer", &options->initializer,
               "Name of the initializer plugin (etalon plugins), or auto: see section [auto].");
  pipeline.add("min_keyframes", &options->min_keyframes, {2, 200},
               "Keyframes of the first window that is tried. It grows with every keyframe until "
               "what [acceptance] wants is predicted and two windows in a row agree. If this is "
               "not less than keyframes, and with initializer = auto, all windows have the length "
               "keyframes, and none is compared with another.");
  pipeline.add("keyframes", &options->keyframes, {2, 200},
               "Keyframes in the initialization window, at most: from then on it slides.");
  pipeline.add("keyframe_rate_hz", &options->keyframe_rate_hz, {0.1, 100.0},
               "Keyframes per second.");
  pipeline.add("confirm_after_s", &options->window.confirm_after_s, {0.0, 10.0},
               "Seconds after the last keyframe at which a growing window takes an additional one, "
               "when it lacks nothing but a second window that agrees. 0: none, the next keyframe "
               "of the rate brings that window.");
  pipeline.add("gravity_mps2", &options->window.gravity_mps2, {0.1, 100.0},
               "Magnitude of gravity, m/s^2.");
  return pipeline;
}

}  // namespace

FixedLagOptions PipelineOptions::fixedLag(const ImuNoiseDensities& data_sheet) const {
  FixedLagOptions options = fixed_lag;
  options.gravity_mps2 = window.gravity_mps2;
  options.sigma_px = window.odometry.sigma_px;
  options.imu_noise = imu_noise.apply(data_sheet);
  return options;
}

std::vector<ParameterSet> PipelineOptions::sections() {
  std::vector<ParameterSet> sets;
  sets.push_back(pipelineSection(this));

  ParameterSet automatic(kAutoInitializer);
  auto_initializer.declare(automatic);
  sets.push_back(automatic);

  ParameterSet priors("priors");
  const char* axes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i)
    priors.add(std::string("gyro_bias_mean_") + axes[i] + "_rps", &window.priors.mean.gyro[i],
               {-10.0, 10.0}, "Mean of the gyro bias before any measurement, rad/s.");
  priors.add("gyro_bias_sigma_rps", &window.priors.sigma_gyro_rps, {1e-9, 1e9},
             "Its standard deviation per axis, rad/s.");
  for (int i = 0; i < 3; ++i)
    priors.add(std::string("accel_bias_mean_") + axes[i] + "_mps2", &window.priors.mean.accel[i],
               {-100.0, 100.0}, "Mean of the accelerometer bias before any measurement, m/s^2.");
  priors.add("accel_bias_sigma_mps2", &window.priors.sigma_accel_mps2, {1e-9, 1e9},
             "Its standard deviation per axis, m/s^2.");
  priors.add(
      "slow_accel_mps2", &window.priors.slow_accel.sigma_mps2, {0.0, 100.0},
      "Standard deviation per axis of the accelerometer's slow error around its bias, m/s^2; "
      "0: none. For VI-BA and initializers that know of it (etalon).");
  priors.add("slow_accel_s", &window.priors.slow_accel.time_s, {1e-3, 1e3},
             "Its time of correlation, s.");
  priors.add(
      "white_accel_share", &window.priors.slow_accel.white_share, {1e-3, 1.0},
      "Share of the accelerometer's density in use that is white where there is a slow error "
      "beside it, because the factors of [imu_noise] cover both errors.");
  priors.add("slow_accel_spread", &window.priors.slow_accel.spread, {0.0, 10.0},
             "Standard deviation, in the logarithm of its variance, of the slow error's size "
             "between windows; the window's own is estimated. 0: slow_accel_mps2 as it is.");
  priors.add("white_accel_spread", &window.priors.slow_accel.white_spread, {0.0, 10.0},
             "The same of the white noise beside it. 0: white_accel_share as it is.");
  priors.add("jolt_spread", &window.priors.slow_accel.jolt_spread, {0.0, 10.0},
             "The same of the white noise of single intervals between keyframes, which may have "
             "more than the window where there is a slow error. 0: none has.");
  sets.push_back(priors);

  const auto declared = [&sets](const char* name, auto& options) {
    ParameterSet set(name);
    options.declare(set);
    sets.push_back(set);
  };
  declared("device", device);
  declared("input", input);
  declared("imu_noise", imu_noise);
  declared("frontend", frontend);
  ParameterSet odometry("odometry");
  odometry.add("kind", &odometry_kind, odometryKinds(),
               "What runs after the start: " + odometryKindsInWords() + ".");
  odometry.add("max_dead_reckoning_s", &max_dead_reckoning_s, {0.0, kLongestGapOfFramesS},
               "Seconds for which the IMU alone carries the pose where images fail; then the "
               "odometry is lost, and starts again.");
  odometry.add("final_ba_keyframes", &final_ba_keyframes, {2, 1000000},
               "Keyframes that etalon replay --final-ba adjusts, at most: of a longer flight the "
               "newest ones (30 kB each).");
  fixed_lag.calibration.declare(odometry);
  window.odometry.declare(odometry);
  sets.push_back(odometry);
  declared(kFixedLag, fixed_lag);
  declared("map", map);
  declared("vi_ba", window.vi_ba);
  declared("acceptance", window.acceptance);
  return sets;
}

}  // namespace etalon
