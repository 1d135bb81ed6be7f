#include <gtest/gtest.h>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::Motion;
using testing::moving;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

const std::string kWithoutPriors = "prior_gyro_information = 0\nprior_accel_information = 0\n";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(OrbSlam3InertialOnly, IsExactOnNoiseFreeDataBeforeAndAfterViBa) {
  testing::expectExactBeforeAndAfterViBa(*load(kWithoutPriors));
}

TEST(OrbSlam3InertialOnly, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(OrbSlam3InertialOnly, FollowsAGyroBiasOfEitherSign) {
  for (const double sign : {-1.0, 1.0}) {
    SyntheticWindowOptions options = moving();
    options.bias.gyro = sign * testing::kBiases.gyro;
    const Outcome o = runOn(options, *load());
    ASSERT_TRUE(o.result) << o.result.error().reason;
    // The prior of 0.1 rad/s pulls by a part in 1e3 at most.
    EXPECT_LT(o.errors.gyro_bias_rps, 1e-4);
  }
}

TEST(OrbSlam3InertialOnly, WithoutReintegrationTheGyroBiasIsOffToSecondOrder) {
  SyntheticWindowOptions options = moving();
  options.bias.gyro = {0.1, -0.1, 0.1};
  const Outcome once = runOn(options, *load(kWithoutPriors + "reintegrations = 0"));
  const Outcome anew = runOn(options, *load(kWithoutPriors));
  ASSERT_TRUE(once.result) << once.result.error().reason;
  EXPECT_GT(once.errors.gyro_bias_rps, 1e-5);
  EXPECT_LT(once.errors.gyro_bias_rps, 0.02 * options.bias.gyro.norm());
  testing::expectWithin(anew, testing::kNumericalPrecision);
}

TEST(OrbSlam3InertialOnly, IsAccurateOnNoisyDataWithOutliers) {
  testing::expectAccurateAfterViBa(*load());
}

TEST(OrbSlam3InertialOnly, LeavesThePosesOfStereoOdometryAsTheyAre) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.1, testing::kBiases);
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  const InitializationResult result = load()->initialize(problem);
  ASSERT_TRUE(result) << result.error().reason;
  const std::vector<SE3>& T_VB = problem.visualSolution()->T_VB;
  const SE3 T_WV = result->states[0].T_WB * T_VB[0].inverse();
  for (size_t k = 0; k < T_VB.size(); ++k)
    EXPECT_LT((result->states[k].T_WB.matrix() - (T_WV * T_VB[k]).matrix()).norm(), 1e-12);
  EXPECT_EQ(result->landmarks.size(), problem.visualSolution()->landmarks.size());
}

TEST(OrbSlam3InertialOnly, PinsTheAccelerometerBiasAsPublished) {
  SyntheticWindowOptions options;
  options.bias.accel = {0.15, 0.0, 0.0};
  const Outcome o = runOn(options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  // A prior of 3.2e-3 m/s^2 against a true bias of 0.15: gravity pays with up to 0.15/9.81 rad.
  EXPECT_GT(o.errors.gravity_deg, 0.1);
  EXPECT_LT(o.errors.gravity_deg, 1.0);
}

TEST(OrbSlam3InertialOnly, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30);
}

TEST(OrbSlam3InertialOnly, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); });
}

TEST(OrbSlam3InertialOnly, RefusesTooFewTracksInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusal(runOn(moving(), *load("min_landmarks = 100000")).result,
                         RefusalStatus::kTooFewTracks, "landmarks in the window");
}

TEST(OrbSlam3InertialOnly, RefusesAMapThatIsNotConvergedOrIllConditioned) {
  testing::expectRefusal(runOn(moving(), *load("max_iterations = 1")).result,
                         RefusalStatus::kNotConverged, "did not converge");
  testing::expectRefusal(runOn(moving(), *load("max_sigma_gravity_deg = 0")).result,
                         RefusalStatus::kIllConditioned, "gravity direction");
}

TEST(OrbSlam3InertialOnly, RefusesAnImuGapAndNonFiniteMeasurements) {
  testing::expectRefusesBrokenInput(*load());
}

}  // namespace
}  // namespace etalon
