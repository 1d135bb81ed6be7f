#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/initialization/plugin_loader.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

/** The initializers whose gyro bias comes from normal epipolar constraints, with their variants. */
struct Configuration {
  const char* label;
  const char* plugin;
  const char* ini;
  bool estimates_accel_bias;
};

constexpr Configuration kConfigurations[] = {
    {"stereo_nec", "stereo_nec", "", true},
    {"stereo_nec_published", "stereo_nec",
     "nec_pairs = consecutive\nnec_cameras = left\nnec_weighting = none\nnec_in_map = seed\n"
     "nec_seed = prior\n",
     true},
    {"stereo_nec_held", "stereo_nec", "nec_in_map = hold\n", true},
    {"drt_tight", "drt", "", true},
    {"drt_loose", "drt", "variant = loose\n", false},
};

class NecFamily : public ::testing::TestWithParam<Configuration> {
 protected:
  static Initializer::Ptr load(const std::string& more = "") {
    const Configuration& c = GetParam();
    PluginLoader loader({ETALON_INITIALIZERS});
    Initializer::Ptr initializer = loader.create(c.plugin);
    ParameterSet parameters(c.plugin);
    initializer->declareParameters(parameters);
    parameters.read(IniFile::fromText(std::string("[") + c.plugin + "]\n" + c.ini + more, "test"));
    return initializer;
  }
  static bool isDrt() { return std::string(GetParam().plugin) == "drt"; }
};

constexpr Motion kMoving[] = {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                              Motion::kPureRotation};

TEST_P(NecFamily, IsExactOnNoiseFreeDataAndFollowsAKnownBias) {
  const Initializer::Ptr initializer =
      load(isDrt() ? "" : "prior_gyro_information = 0\nprior_accel_information = 0\n");
  for (const Motion motion : kMoving) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    if (!GetParam().estimates_accel_bias) options.bias.accel.setZero();
    options.priors.sigma_gyro_rps = options.priors.sigma_accel_mps2 = 1e5;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = initializer->initialize(makeProblem(window, options));
    ASSERT_TRUE(result.ok()) << result.reason;
    const WindowErrors e = errorsOf(result.states, result.bias, window);
    // The bars for noise-free data.
    EXPECT_LT(e.rre_deg, 1e-4);
    EXPECT_LT(e.gravity_deg, 0.01);
    EXPECT_LT(e.gyro_bias_rps, 1e-5);
    EXPECT_LT(e.accel_bias_mps2, 1e-4);
    EXPECT_LT(e.velocity_mps, 1e-4);
    EXPECT_LT(e.ate_m, 1e-5);
  }
}

TEST_P(NecFamily, IsExactAtRestAndAtConstantVelocityToo) {
  const Initializer::Ptr initializer = load();
  for (const Motion motion : {Motion::kStandstill, Motion::kConstantVelocity}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias.gyro = {0.02, -0.06, 0.04};
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = initializer->initialize(makeProblem(window, options));
    ASSERT_TRUE(result.ok()) << result.reason;
    const WindowErrors e = errorsOf(result.states, result.bias, window);
    // The weak priors of the MAP (sigma 0.1 rad/s) pull the bias by a part in 1e4.
    EXPECT_LT(e.gyro_bias_rps, 1e-4);
    EXPECT_LT(e.rre_deg, 1e-3);
    EXPECT_LT(e.velocity_mps, 1e-3);
    EXPECT_LT(e.gravity_deg, 0.01);
  }
}

TEST_P(NecFamily, SurvivesNoiseAndThirtyPercentOutliers) {
  const Initializer::Ptr initializer = load();
  for (const Motion motion : {Motion::kAggressive, Motion::kCircle}) {
    SCOPED_TRACE(testing::toString(motion));
    if (!isDrt() && motion == Motion::kCircle) continue;  // there stereo odometry gives up
    SyntheticWindowOptions options;
    options.motion = motion;
    options.sigma_px = options.assumed_sigma_px = 0.5;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    options.outlier_share = 0.16;  // of observations: 30 % of the matches of two
    options.bias = {{0.02, -0.06, 0.04}, {0.02, -0.01, 0.03}};
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationResult result = initializer->initialize(makeProblem(window, options));
    ASSERT_TRUE(result.ok()) << result.reason;
    const WindowErrors e = errorsOf(result.states, result.bias, window);
    // One draw, three times what these methods do on flights without outliers.
    EXPECT_LT(e.rre_deg, 0.05);
    EXPECT_LT(e.gyro_bias_rps, 4e-3);
    EXPECT_LT(e.velocity_mps, 0.05);
    EXPECT_LT(e.gravity_deg, 1.0);
  }
}

TEST_P(NecFamily, GivesTheSameResultBitForBit) {
  const Initializer::Ptr initializer = load();
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult a = initializer->initialize(makeProblem(window, options));
  const InitializationResult b = initializer->initialize(makeProblem(window, options));
  ASSERT_TRUE(a.ok()) << a.reason;
  EXPECT_EQ(a.bias.gyro, b.bias.gyro);
  EXPECT_EQ(a.bias.accel, b.bias.accel);
  for (size_t k = 0; k < a.states.size(); ++k) {
    EXPECT_EQ(a.states[k].T_WB.R, b.states[k].T_WB.R);
    EXPECT_EQ(a.states[k].T_WB.t, b.states[k].T_WB.t);
    EXPECT_EQ(a.states[k].v_WB, b.states[k].v_WB);
  }
}

TEST_P(NecFamily, RefusesTooFewTracksAndNoOverlapInWords) {
  const Initializer::Ptr initializer = load();
  const SyntheticWindowOptions options;
  SyntheticWindow few = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : few.frames) frame.observations.resize(5);
  const InitializationResult too_few = initializer->initialize(makeProblem(few, options));
  EXPECT_FALSE(too_few.ok());
  EXPECT_FALSE(too_few.reason.empty());
  if (isDrt()) {
    EXPECT_EQ(too_few.status, InitializationStatus::kTooFewTracks) << too_few.reason;
  }

  // No landmark is seen in two frames.
  SyntheticWindow apart = testing::makeSyntheticWindow(options);
  LandmarkId id = 0;
  for (TrackedFrame& frame : apart.frames)
    for (Observation& o : frame.observations) o.id = id++;
  const InitializationResult no_overlap = initializer->initialize(makeProblem(apart, options));
  EXPECT_FALSE(no_overlap.ok());
  EXPECT_FALSE(no_overlap.reason.empty());
}

TEST_P(NecFamily, RefusesTracksThatAreNoisierThanBelieved) {
  const Initializer::Ptr initializer = load();
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.sigma_px = 5.0;
  options.assumed_sigma_px = 0.5;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult result = initializer->initialize(makeProblem(window, options));
  EXPECT_FALSE(result.ok());
  EXPECT_FALSE(result.reason.empty());
}

INSTANTIATE_TEST_SUITE_P(Plugins, NecFamily, ::testing::ValuesIn(kConfigurations),
                         [](const auto& c) { return std::string(c.param.label); });

TEST(Drt, NeedsNoVisualSolution) {
  PluginLoader loader({ETALON_INITIALIZERS});
  const Initializer::Ptr initializer = loader.create("drt");
  EXPECT_FALSE(initializer->needsVisualSolution());
  const SyntheticWindowOptions options;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  EXPECT_TRUE(initializer->initialize(problem).ok());
  EXPECT_FALSE(problem.visualSolutionComputed());
}

}  // namespace
}  // namespace etalon
