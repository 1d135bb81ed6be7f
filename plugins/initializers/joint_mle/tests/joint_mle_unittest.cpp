#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::kBiases;
using testing::Motion;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindowOptions;

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(JointMle, IsExactWithoutNoiseWhereThePriorsAreTrue) {
  for (const Motion motion : testing::kExcitingMotions) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = kBiases;
    options.priors.mean = kBiases;
    testing::expectWithin(runOn(options, *load()), testing::kNumericalPrecision);
  }
}

TEST(JointMle, NeedsNoVisualOdometry) { EXPECT_FALSE(load()->needsVisualSolution()); }

/** Standing still tells neither b_a nor tilt: there is a direction that only the priors hold. */
TEST(JointMle, RefusesWhatTheDataDoNotTell) {
  SyntheticWindowOptions options;
  options.motion = Motion::kStandstill;
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "the weakest direction");
}

/** The chosen tracks are the longest; all others jump to and fro. */
TEST(JointMle, RefusesWhatTheOtherTracksDoNotAgreeWith) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.0, {kBiases.gyro, {0.05, -0.04, 0.03}});
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  EXPECT_TRUE(runOn(window, options, *load()).result);
  std::map<LandmarkId, size_t> length;
  for (const TrackedFrame* frame : window.keyframes())
    for (const Observation& o : frame->observations) ++length[o.id];
  for (size_t i = 0; i < window.frames.size(); ++i)
    for (Observation& o : window.frames[i].observations)
      if (length[o.id] < window.keyframe_indices.size())
        o.left.y() += i / 5 % 2 == 0 ? 15.0 : -15.0;
  testing::expectRefusal(runOn(window, options, *load()).result, RefusalStatus::kNotConverged,
                         "of the other tracks' pixels agree");
}

TEST(JointMle, ErrsAsItsCovarianceSays) { testing::expectErrsAsItsCovarianceSays(*load(), 0.05); }

TEST(JointMle, MoreTracksKnowMore) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.0, {kBiases.gyro, {0.05, -0.04, 0.03}});
  const Outcome few = runOn(options, *load()), many = runOn(options, *load("tracks = 100"));
  ASSERT_TRUE(few.result && many.result);
  EXPECT_LT(many.result->covariance.diagonal().segment<3>(8).sum(),
            few.result->covariance.diagonal().segment<3>(8).sum());
}

TEST(JointMle, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); },
                          testing::noisyOptions(Motion::kAggressive, 0.0, kBiases));
}

TEST(JointMle, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesBrokenInput(*load());
}

/** The right camera sees a sixth of the landmarks, whose tracks are the shorter ones. */
TEST(JointMle, TakesTracksThatBothCamerasSee) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.0, {kBiases.gyro, {0.05, -0.04, 0.03}});
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.has_right = o.has_right && o.id % 6 == 0;
  auto& last = window.frames.back().observations;
  last.erase(std::remove_if(last.begin(), last.end(), [](const auto& o) { return o.has_right; }),
             last.end());
  const Outcome o = runOn(window, options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_LT(o.errors.gravity_deg, 2.0);  // what counts as a success
  EXPECT_LT(o.errors.velocity_mps, 0.1);
}

}  // namespace
}  // namespace etalon
