// What the host checks of an answer before it believes it, one promise after the other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "etalon/core/errors.h"
#include "etalon/initialization/initializer.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using Change = std::function<void(Initialization*)>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/** Answers that the body has been at rest, as `change` leaves it. */
class Resting : public Initializer {
  DEFINE_MRPT_OBJECT(Resting, etalon)

 public:
  Resting() = default;
  explicit Resting(Change change) : change_(std::move(change)) {}
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    Initialization rest;
    for (int k = 0; k < problem.keyframeCount(); ++k) {
      StampedState state;
      state.t = problem.keyframe(k).t;
      rest.states.push_back(state);
    }
    rest.bias = {{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
    rest.landmarks[7] = {1.0, 2.0, 3.0};
    rest.covariance = Eigen::MatrixXd::Identity(11, 11);
    if (change_) change_(&rest);
    return rest;
  }

 private:
  Change change_;
};

IMPLEMENTS_MRPT_OBJECT(Resting, etalon::Initializer, etalon)

/** Two keyframes a tenth of a second apart, with an IMU at 200 Hz. */
InitializationProblem::Data goodData() {
  InitializationProblem::Data data;
  for (int k = 0; k < 2; ++k) {
    data.frames.push_back({k * 100'000'000, {}, {}});
    data.keyframe_indices.push_back(k);
  }
  std::vector<ImuSample> samples;
  for (TimeNs t = 0; t <= 100'000'000; t += 5'000'000)
    samples.push_back({t, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
  data.imu = ImuBuffer(samples);
  return data;
}

InitializationResult answered(const Change& change) {
  return Resting(change).initialize(InitializationProblem(goodData()));
}

/** The reason of a refusal that the host made of a success. */
std::string reasonOf(const Change& change) {
  const InitializationResult result = answered(change);
  if (result) return "";
  EXPECT_EQ(result.error().status, RefusalStatus::kNotConverged);
  return result.error().reason;
}

TEST(InitializerPromises, AGoodAnswerComesThroughWithItsBiasInEveryState) {
  const InitializationResult result = answered(nullptr);
  ASSERT_TRUE(result) << result.error().reason;
  EXPECT_EQ(result->states.size(), 2U);
  for (const StampedState& state : result->states) {
    EXPECT_EQ(state.bias.gyro, Eigen::Vector3d(0.01, 0.02, 0.03));
    EXPECT_EQ(state.bias.accel, Eigen::Vector3d(0.1, 0.2, 0.3));
  }
  // Neither landmarks nor a covariance are promised.
  EXPECT_TRUE(answered([](Initialization* r) {
    r->covariance.resize(0, 0);
    r->landmarks.clear();
  }));
}

TEST(InitializerPromises, EveryNumberIsFinite) {
  EXPECT_THAT(reasonOf([](auto* r) { r->states[1].T_WB.R(0, 2) = kNaN; }),
              HasSubstr("reports success with a T_WB not finite at keyframe 1"));
  EXPECT_THAT(reasonOf([](auto* r) { r->states[0].T_WB.t.y() = kNaN; }),
              HasSubstr("a T_WB not finite at keyframe 0"));
  EXPECT_THAT(reasonOf([](auto* r) { r->states[1].v_WB.x() = INFINITY; }),
              HasSubstr("a v_WB not finite at keyframe 1"));
  EXPECT_THAT(reasonOf([](auto* r) { r->bias.gyro.z() = kNaN; }),
              HasSubstr("a gyro bias not finite"));
  EXPECT_THAT(reasonOf([](auto* r) { r->bias.accel.x() = -INFINITY; }),
              HasSubstr("an accelerometer bias not finite"));
  EXPECT_THAT(reasonOf([](auto* r) { r->landmarks[7].z() = kNaN; }),
              HasSubstr("a position not finite for landmark 7"));
  EXPECT_THAT(reasonOf([](auto* r) { r->covariance(10, 0) = kNaN; }),
              HasSubstr("a covariance not finite"));
  EXPECT_THAT(reasonOf([](auto* r) {
                r->T_BC = SE3(2.0 * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
              }),
              HasSubstr("a T_BC that is no rigid transform"));
}

TEST(InitializerPromises, StatesAreThoseOfTheKeyframes) {
  EXPECT_THAT(reasonOf([](auto* r) { r->states[1].t += 1; }),
              HasSubstr("another stamp than the keyframe's at keyframe 1"));
  EXPECT_THAT(reasonOf([](auto* r) { r->states.push_back(r->states[1]); }),
              HasSubstr("3 states for 2 keyframes"));
  EXPECT_THAT(reasonOf([](auto* r) { r->covariance = Eigen::MatrixXd::Identity(11, 10); }),
              HasSubstr("a covariance that is neither 11 x 11 nor, with the poses, 17 square"));
  EXPECT_THAT(reasonOf([](auto* r) { r->covariance = Eigen::MatrixXd::Identity(15, 15); }),
              HasSubstr("a covariance that is neither 11 x 11 nor, with the poses, 17 square"));
  EXPECT_EQ(reasonOf([](auto* r) { r->covariance = Eigen::MatrixXd::Identity(17, 17); }), "");
}

TEST(InitializerPromises, ARotationIsOneToSixDigits) {
  const auto stretched = [](double by) {
    return answered([by](Initialization* r) { r->states[0].T_WB.R(0, 0) += by; }).has_value();
  };
  EXPECT_TRUE(stretched(4e-7));  // R^T R is off by twice that
  EXPECT_FALSE(stretched(6e-7));
  EXPECT_THAT(reasonOf([](auto* r) { r->states[1].T_WB.R(2, 2) = -1.0; }),  // a mirror
              HasSubstr("a T_WB that is no rigid transform at keyframe 1"));
}

TEST(InitializerPromises, ANominalRateThatIsNoneIsRefused) {
  for (const double rate : {0.0, -200.0, kNaN, static_cast<double>(INFINITY)}) {
    InitializationProblem::Data data = goodData();
    data.calibration.imu.rate_hz = rate;
    const InitializationResult result = Resting().initialize(InitializationProblem(data));
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().status, RefusalStatus::kInvalidInput);
    EXPECT_THAT(result.error().reason, HasSubstr("nominal IMU rate"));
  }
}

}  // namespace
}  // namespace etalon
