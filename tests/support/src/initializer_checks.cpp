#include "etalon/testing/initializer_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/symmetric.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/plugin_loader.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon::testing {

namespace {

std::vector<StampedState> statesAfterViBa(const InitializationAttempt& attempt) {
  std::vector<StampedState> result;
  for (size_t k = 0; k < attempt.vi_ba.states.size(); ++k)
    result.emplace_back(attempt.keyframes[k], attempt.vi_ba.states[k]);
  return result;
}

void expectExact(const InitializationAttempt& attempt, const SyntheticWindow& window) {
  ASSERT_TRUE(attempt.init) << attempt.init.error().reason;
  expectWithin(errorsOf(attempt.init->states, attempt.init->bias, window), kNumericalPrecision);
  ASSERT_TRUE(attempt.has_vi_ba);
  expectWithin(errorsOf(statesAfterViBa(attempt), attempt.vi_ba.bias, window), kNumericalPrecision);
  EXPECT_TRUE(attempt.accepted()) << attempt.decision.error().reason;
}

void expectRefusedInWords(const InitializationResult& result) {
  ASSERT_FALSE(result);
  EXPECT_FALSE(result.error().reason.empty());
}

}  // namespace

Initializer::Ptr loadInitializer(const std::string& library, const std::string& ini) {
  PluginLoader loader({library});
  const std::string section = loader.info(library).name;
  Initializer::Ptr initializer = loader.create(library);
  ParameterSet parameters(section);
  initializer->declareParameters(parameters);
  parameters.read(IniFile::fromText("[" + section + "]\n" + ini, "test"));
  return initializer;
}

Outcome runOn(const SyntheticWindow& window, const SyntheticWindowOptions& options,
              const Initializer& initializer) {
  Outcome outcome{window, initializer.initialize(makeProblem(window, options)), {}};
  if (outcome.result)
    outcome.errors = errorsOf(outcome.result->states, outcome.result->bias, window);
  return outcome;
}

Outcome runOn(const SyntheticWindowOptions& options, const Initializer& initializer) {
  return runOn(makeSyntheticWindow(options), options, initializer);
}

SyntheticWindowOptions moving() {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  return options;
}

SyntheticWindowOptions noisyOptions(Motion motion, double outlier_share, const ImuBias& bias) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.sigma_px = options.assumed_sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.outlier_share = outlier_share;
  options.bias = bias;
  return options;
}

SyntheticWindowOptions freeOptions(Motion motion, const ImuBias& bias) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.bias = bias;
  options.priors.sigma_gyro_rps = options.priors.sigma_accel_mps2 = 1e5;
  return options;
}

void expectWithin(const WindowErrors& errors, const WindowErrors& bounds) {
  EXPECT_LT(errors.rre_deg, bounds.rre_deg);
  EXPECT_LT(errors.ate_m, bounds.ate_m);
  EXPECT_LT(errors.gravity_deg, bounds.gravity_deg);
  EXPECT_LT(errors.velocity_mps, bounds.velocity_mps);
  EXPECT_LT(errors.gyro_bias_rps, bounds.gyro_bias_rps);
  EXPECT_LT(errors.accel_bias_mps2, bounds.accel_bias_mps2);
}

void expectWithin(const Outcome& outcome, const WindowErrors& bounds) {
  ASSERT_TRUE(outcome.result) << outcome.result.error().reason;
  expectWithin(outcome.errors, bounds);
}

void expectRefusal(const InitializationResult& result, RefusalStatus status,
                   const std::string& words) {
  ASSERT_FALSE(result) << "no refusal";
  const std::string& reason = result.error().reason;
  EXPECT_STREQ(toString(result.error().status), toString(status)) << reason;
  EXPECT_NE(reason.find(words), std::string::npos) << "expected '" << words << "' in: " << reason;
}

void expectExactBeforeAndAfterViBa(const Initializer& initializer) {
  for (const Motion motion : kExcitingMotions) {
    SCOPED_TRACE(toString(motion));
    const SyntheticWindowOptions options = freeOptions(motion, kBiases);
    const SyntheticWindow window = makeSyntheticWindow(options);
    WindowOptions run;
    run.priors = options.priors;
    run.vi_ba.rounds = 4;
    run.vi_ba.iterations_per_round = 30;
    run.vi_ba.reintegrate_gyro_rps = run.vi_ba.reintegrate_accel_mps2 = 0.0;
    expectExact(attemptInitialization(makeProblem(window, options), initializer, run), window);
  }
}

void expectExactWhereThePriorsAreTrue(const Initializer& initializer) {
  for (const Motion motion : kAllMotions) {
    SCOPED_TRACE(toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    const SyntheticWindow window = makeSyntheticWindow(options);
    expectExact(attemptInitialization(makeProblem(window, options), initializer, WindowOptions()),
                window);
  }
}

void expectAccurateAfterViBa(const Initializer& initializer) {
  for (const Motion motion : kExcitingMotions) {
    SCOPED_TRACE(toString(motion));
    const SyntheticWindowOptions options =
        noisyOptions(motion, 0.1, {kBiases.gyro, {0.05, -0.04, 0.03}});
    WindowOptions run;
    run.odometry.sigma_px = options.assumed_sigma_px;
    const SyntheticWindow window = makeSyntheticWindow(options);
    const InitializationAttempt attempt =
        attemptInitialization(makeProblem(window, options), initializer, run);
    ASSERT_TRUE(attempt.accepted()) << attempt.decision.error().reason;
    const WindowErrors e = errorsOf(statesAfterViBa(attempt), attempt.vi_ba.bias, window);
    // Three to five times the Cramer-Rao bounds of a 2.25 s window at 1 px: one draw, not a mean.
    EXPECT_LT(e.rre_deg, 0.04);
    EXPECT_LT(e.velocity_mps, 0.02);
    EXPECT_LT(e.gyro_bias_rps, 3e-3);
    EXPECT_LT(e.gravity_deg, 1.5);
  }
}

void expectExactAtRestAndAtConstantVelocity(const Initializer& initializer) {
  for (const Motion motion : {Motion::kStandstill, Motion::kConstantVelocity}) {
    SCOPED_TRACE(toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias.gyro = kBiases.gyro;
    const Outcome o = runOn(options, initializer);
    ASSERT_TRUE(o.result) << o.result.error().reason;
    // The weak priors of the MAP (sigma 0.1 rad/s) pull the bias by a part in 1e4.
    EXPECT_LT(o.errors.gyro_bias_rps, 1e-4);
    EXPECT_LT(o.errors.rre_deg, 1e-3);
    EXPECT_LT(o.errors.velocity_mps, 1e-3);
    EXPECT_LT(o.errors.gravity_deg, 0.01);
  }
}

void expectSurvivesThirtyPercentOutliers(const Initializer& initializer, Motion motion) {
  SCOPED_TRACE(toString(motion));
  // 16 % of observations are 30 % of the matches of two.
  const Outcome o =
      runOn(noisyOptions(motion, 0.16, {kBiases.gyro, {0.02, -0.01, 0.03}}), initializer);
  ASSERT_TRUE(o.result) << o.result.error().reason;
  // One draw, three times what these methods do on flights without outliers.
  EXPECT_LT(o.errors.rre_deg, 0.05);
  EXPECT_LT(o.errors.gyro_bias_rps, 4e-3);
  EXPECT_LT(o.errors.velocity_mps, 0.05);
  EXPECT_LT(o.errors.gravity_deg, 1.0);
}

void expectSurvivesOutliersOfStereoOdometry(const Initializer& initializer) {
  const Outcome o =
      runOn(noisyOptions(Motion::kGentle, 0.3, {kBiases.gyro, {0.05, -0.04, 0.03}}), initializer);
  ASSERT_TRUE(o.result) << o.result.error().reason;
  // As vins_alignment, whose poses these are.
  EXPECT_LT(o.errors.rre_deg, 0.3);
  EXPECT_LT(o.errors.velocity_mps, 0.15);
  EXPECT_LT(o.errors.gyro_bias_rps, 0.01);
}

void expectSameBits(const std::function<Initializer::Ptr()>& load) {
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  expectSameBits(load, options);
}

SyntheticWindowOptions drawnOptions(Motion motion, unsigned seed, double sigma_px) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.seed = seed;
  options.frames_per_keyframe = 1;
  options.landmarks = 120;
  options.sigma_px = options.assumed_sigma_px = sigma_px;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  std::mt19937 rng(seed + 1000);
  std::normal_distribution<double> normal;
  for (int axis = 0; axis < 3; ++axis) {
    options.bias.gyro[axis] = options.priors.sigma_gyro_rps * normal(rng);
    options.bias.accel[axis] = options.priors.sigma_accel_mps2 * normal(rng);
  }
  return options;
}

SyntheticWindow withoutBiasWalk(const SyntheticWindowOptions& options) {
  SyntheticWindow window = makeSyntheticWindow(options);
  ImuNoiseDensities& noise = window.calibration.imu.noise;
  noise.gyro_random_walk *= 1e-3;
  noise.accel_random_walk *= 1e-3;
  return window;
}

void expectErrsInProportionToThePixelNoise(const Initializer& initializer) {
  constexpr int kWindows = 10;
  for (const double sigma_px : {0.5, 1.0}) {
    double sum = 0.0;
    for (unsigned seed = 1; seed <= kWindows; ++seed) {
      const Outcome o = runOn(drawnOptions(Motion::kGentle, seed, sigma_px), initializer);
      ASSERT_TRUE(o.result) << o.result.error().reason;
      sum += o.errors.velocity_mps / kWindows;
    }
    EXPECT_LT(sum, 0.006 * sigma_px + 0.001) << sigma_px << " px";
  }
}

void expectErrsAsItsCovarianceSays(const Initializer& initializer, double slack,
                                   int least_answers) {
  constexpr int kWindows = 40;
  for (const double sigma_px : {0.1, 0.5}) {
    int answers = 0;
    struct Block {
      const char* name;
      Eigen::Index start, size;
      double sum = 0.0;
    };
    std::vector<Block> blocks;
    for (unsigned seed = 1; seed <= kWindows; ++seed) {
      const SyntheticWindowOptions options = drawnOptions(Motion::kAggressive, seed, sigma_px);
      const Outcome o = runOn(withoutBiasWalk(options), options, initializer);
      if (!o.result && least_answers < kWindows) continue;
      ASSERT_TRUE(o.result) << o.result.error().reason;
      ++answers;
      const Eigen::Index errors = 11 + 6 * (options.keyframes - 1);
      if (blocks.empty())
        blocks = {{"b_g", 0, 3},      {"b_a", 3, 3},  {"gravity", 6, 2},
                  {"velocity", 8, 3}, {"all", 0, 11}, {"poses", 11, errors - 11}};
      const Eigen::MatrixXd& P = o.result->covariance;
      ASSERT_EQ(P.rows(), errors);
      Eigen::VectorXd e(errors);
      e << estimationError(*o.result, o.window),
          relativePoseErrors(o.result->states, o.window.truth);
      for (Block& block : blocks) {
        const Eigen::VectorXd part = e.segment(block.start, block.size);
        const Eigen::MatrixXd own = P.block(block.start, block.start, block.size, block.size);
        block.sum += squaredMahalanobis(part, own);
      }
    }
    ASSERT_GE(answers, least_answers) << sigma_px << " px";
    for (const Block& block : blocks) {
      const double freedom = static_cast<double>(block.size * answers);
      EXPECT_NEAR(block.sum / freedom, 1.0, 3.0 * std::sqrt(2.0 / freedom) + slack)
          << block.name << " at " << sigma_px << " px";
    }
  }
}

void expectSameBits(const std::function<Initializer::Ptr()>& load,
                    const SyntheticWindowOptions& options) {
  const auto attempt = [&] {
    return attemptInitialization(makeProblem(makeSyntheticWindow(options), options), *load(),
                                 WindowOptions());
  };
  const InitializationAttempt a = attempt(), b = attempt();
  ASSERT_TRUE(a.init) << a.init.error().reason;
  ASSERT_TRUE(b.init) << b.init.error().reason;
  EXPECT_EQ(a.init->bias.gyro, b.init->bias.gyro);
  EXPECT_EQ(a.init->bias.accel, b.init->bias.accel);
  EXPECT_EQ(a.init->landmarks, b.init->landmarks);
  EXPECT_EQ(a.vi_ba.bias.gyro, b.vi_ba.bias.gyro);
  EXPECT_EQ(a.vi_ba.bias.accel, b.vi_ba.bias.accel);
  ASSERT_EQ(a.vi_ba.states.size(), a.init->states.size());
  for (size_t k = 0; k < a.init->states.size(); ++k) {
    EXPECT_EQ(a.init->states[k].T_WB.R, b.init->states[k].T_WB.R);
    EXPECT_EQ(a.init->states[k].T_WB.t, b.init->states[k].T_WB.t);
    EXPECT_EQ(a.init->states[k].v_WB, b.init->states[k].v_WB);
    EXPECT_EQ(a.vi_ba.states[k].T_WB.t, b.vi_ba.states[k].T_WB.t);
  }
}

InitializationResult expectRefusesTooFewTracks(const Initializer& initializer) {
  const SyntheticWindowOptions options;
  SyntheticWindow window = makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames) frame.observations.resize(5);
  const InitializationAttempt attempt =
      attemptInitialization(makeProblem(window, options), initializer, WindowOptions());
  expectRefusedInWords(attempt.init);
  EXPECT_FALSE(attempt.accepted());
  EXPECT_FALSE(attempt.decision.error().reason.empty());
  return attempt.init;
}

void expectRefusesTracksWithoutOverlap(const Initializer& initializer) {
  const SyntheticWindowOptions options;
  SyntheticWindow window = makeSyntheticWindow(options);
  LandmarkId id = 0;
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.id = id++;
  expectRefusedInWords(runOn(window, options, initializer).result);
}

void expectRefusesTracksNoisierThanBelieved(const Initializer& initializer) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.sigma_px = 5.0;
  options.assumed_sigma_px = 0.5;
  expectRefusedInWords(runOn(options, initializer).result);
}

void expectRefusesAnAccelerometerThatShowsNoGravity(const Initializer& initializer) {
  SyntheticWindowOptions options;
  options.motion = Motion::kStandstill;
  SyntheticWindow window = makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& s : samples) s.accel *= 0.05;
  window.imu = ImuBuffer(samples);
  const InitializationResult result = runOn(window, options, initializer).result;
  expectRefusal(result, RefusalStatus::kImplausible, "no direction for gravity");
  EXPECT_NEAR(*result.error().value, 0.05 * 9.81, 1e-6);
}

void expectRefusesBrokenInput(const Initializer& initializer) {
  const SyntheticWindowOptions options;
  const SyntheticWindow window = makeSyntheticWindow(options);

  SyntheticWindow with_gap = window;
  std::vector<ImuSample> samples;
  for (const ImuSample& s : window.imu.samples())
    if (std::abs(secondsBetween(options.start, s.t) - 1.0) > 0.1) samples.push_back(s);
  with_gap.imu = ImuBuffer(samples);
  const InitializationResult gap = runOn(with_gap, options, initializer).result;
  EXPECT_EQ(gap.error().status, RefusalStatus::kImuGap) << gap.error().reason;
  EXPECT_NEAR(*gap.error().value, 0.2, 0.02);

  SyntheticWindow with_nan = window;
  with_nan.frames[3].observations[2].left.x() = std::nan("");
  const InitializationResult nan = runOn(with_nan, options, initializer).result;
  EXPECT_EQ(nan.error().status, RefusalStatus::kInvalidInput) << nan.error().reason;
}

}  // namespace etalon::testing
