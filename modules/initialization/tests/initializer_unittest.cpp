#include "etalon/initialization/initializer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <typeinfo>

#include "etalon/imu/imu_limits.h"
#include "plugins/test_initializer.h"

ETALON_TEST_INITIALIZER(Linked)

namespace etalon {
namespace {

using ::testing::HasSubstr;
using Data = InitializationProblem::Data;

constexpr TimeNs kStep = 5'000'000;  // 200 Hz

/** Three keyframes 0.1 s apart with two landmarks, IMU at 200 Hz from 0 to 0.2 s. */
Data goodWindow() {
  Data data;
  for (int k = 0; k < 3; ++k) {
    Observation a, b;
    a.id = 1;
    a.left = {10.0, 20.0};
    b.id = 2;
    b.left = {30.0, 40.0};
    b.right = {25.0, 40.0};
    b.has_right = true;
    data.frames.push_back({k * 100'000'000, {a, b}, {}});
    data.keyframe_indices.push_back(k);
  }
  std::vector<ImuSample> samples;
  for (TimeNs t = 0; t <= 200'000'000; t += kStep) {
    samples.push_back({t, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
  }
  data.imu = ImuBuffer(samples);
  return data;
}

InitializationResult solveWith(const std::string& answer, const Data& data) {
  test_plugins::Linked initializer;
  ParameterSet parameters("test");
  initializer.declareParameters(parameters);
  parameters.read(IniFile::fromText("[test]\nanswer = " + answer + "\n", "test.ini"));
  return initializer.initialize(InitializationProblem(data));
}

InitializationResult solveAfter(const std::function<void(Data*)>& change) {
  Data data = goodWindow();
  change(&data);
  return solveWith("rest", data);
}

std::vector<ImuSample> without(const std::vector<ImuSample>& samples, size_t first, size_t last) {
  std::vector<ImuSample> kept = samples;
  kept.erase(kept.begin() + first, kept.begin() + last);
  return kept;
}

TEST(Initializer, PassesAGoodProblemAndAGoodAnswer) {
  const InitializationResult result = solveWith("rest", goodWindow());
  EXPECT_TRUE(result) << result.error().reason;
  EXPECT_EQ(result->states.size(), 3U);
}

TEST(Initializer, RefusesFewerThanTwoKeyframes) {
  const auto result = solveAfter([](Data* data) { data->keyframe_indices = {1}; });
  EXPECT_EQ(result.error().status, RefusalStatus::kTooFewKeyframes);
  EXPECT_EQ(*result.error().value, 1.0);
  EXPECT_THAT(result.error().reason, HasSubstr("1 keyframe"));
  EXPECT_EQ(solveAfter([](Data* data) { data->keyframe_indices.clear(); }).error().status,
            RefusalStatus::kTooFewKeyframes);
}

TEST(Initializer, RefusesFramesOutOfOrderAndPixelsNotFinite) {
  const auto order = solveAfter([](Data* data) { data->frames[2].t = data->frames[1].t; });
  EXPECT_EQ(order.error().status, RefusalStatus::kInvalidInput);
  EXPECT_THAT(order.error().reason, HasSubstr("frame 2"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto left = solveAfter([&](Data* data) { data->frames[1].observations[0].left.x() = nan; });
  EXPECT_EQ(left.error().status, RefusalStatus::kInvalidInput);
  EXPECT_THAT(left.error().reason, HasSubstr("landmark 1 in frame 1"));
  const auto right =
      solveAfter([&](Data* data) { data->frames[1].observations[1].right.y() = nan; });
  EXPECT_EQ(right.error().status, RefusalStatus::kInvalidInput);
  // Without has_right the right pixel means nothing.
  EXPECT_TRUE(solveAfter([&](Data* data) { data->frames[1].observations[0].right.x() = nan; }));
}

TEST(Initializer, RefusesImuNotFinite) {
  const auto result = solveAfter([](Data* data) {
    std::vector<ImuSample> samples = data->imu.samples();
    samples[4].accel.z() = std::numeric_limits<double>::infinity();
    data->imu = ImuBuffer(samples);
  });
  EXPECT_EQ(result.error().status, RefusalStatus::kInvalidInput);
  EXPECT_THAT(result.error().reason, HasSubstr("IMU sample 4"));
}

TEST(Initializer, RefusesAnImuThatDoesNotCoverTheWindow) {
  const auto late =
      solveAfter([](Data* data) { data->imu = ImuBuffer(without(data->imu.samples(), 0, 10)); });
  EXPECT_EQ(late.error().status, RefusalStatus::kImuGap);
  EXPECT_NEAR(*late.error().value, 0.05, 1e-12);  // rounding of one division
  const auto none = solveAfter([](Data* data) { data->imu = ImuBuffer(); });
  EXPECT_EQ(none.error().status, RefusalStatus::kImuGap);
  EXPECT_NEAR(*none.error().value, 0.2, 1e-12);
}

TEST(Initializer, RefusesAGapLongerThanTheLongestImuStep) {
  // 30 ms at 200 Hz: taking out 4 samples leaves a step of 25 ms, 6 leave 35 ms.
  EXPECT_TRUE(
      solveAfter([](Data* data) { data->imu = ImuBuffer(without(data->imu.samples(), 10, 14)); }));
  const auto result =
      solveAfter([](Data* data) { data->imu = ImuBuffer(without(data->imu.samples(), 10, 16)); });
  EXPECT_EQ(result.error().status, RefusalStatus::kImuGap);
  EXPECT_NEAR(*result.error().value, 0.035, 1e-12);
  EXPECT_EQ(*result.error().bound, longestImuStep(200.0));
  EXPECT_THAT(result.error().reason, HasSubstr("gap of 0.035 s"));
}

/** The pipeline and the odometry bridge such a gap, too. */
TEST(Initializer, BridgesSevenMissingSamplesOfAFastImu) {
  EXPECT_TRUE(solveAfter([](Data* data) {
    data->calibration.imu.rate_hz = 1000.0;
    std::vector<ImuSample> samples;
    for (TimeNs t = 0; t <= 200'000'000; t += 1'000'000)
      samples.push_back({t, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
    data->imu = ImuBuffer(without(samples, 100, 107));
  }));
}

TEST(Initializer, StandsInTheNamespaceOfItsAbiVersion) {
  const std::string space = "abi_v" + std::to_string(ETALON_INITIALIZER_ABI);
  // As the compiler writes it: each name behind its length.
  EXPECT_THAT(typeid(Initializer).name(),
              HasSubstr(std::to_string(space.size()) + space + "11Initializer"));
}

/** What a plugin reads by offset. Sizes are those of x86-64 with GCC's library. */
TEST(Initializer, ItsTypesHaveTheSizesOfItsAbiVersion) {
  EXPECT_EQ(ETALON_INITIALIZER_ABI, 8) << "a new version: set the sizes below";
  EXPECT_EQ(sizeof(BiasPriors), 112U) << "raise ETALON_INITIALIZER_ABI";
  EXPECT_EQ(sizeof(Data), 768U) << "raise ETALON_INITIALIZER_ABI";
  EXPECT_EQ(sizeof(Initialization), 272U) << "raise ETALON_INITIALIZER_ABI";
}

TEST(Initializer, TurnsWhatSolveThrowsIntoARefusal) {
  const auto error = solveWith("error", goodWindow());
  EXPECT_EQ(error.error().status, RefusalStatus::kNotConverged);
  EXPECT_THAT(error.error().reason, HasSubstr("a refusal thrown by the plugin"));
  const auto data_error = solveWith("data_error", goodWindow());
  EXPECT_EQ(data_error.error().status, RefusalStatus::kInvalidInput);
  EXPECT_THAT(data_error.error().reason, HasSubstr("imu.csv:7"));
  const auto exception = solveWith("exception", goodWindow());
  EXPECT_EQ(exception.error().status, RefusalStatus::kNotConverged);
  EXPECT_THAT(exception.error().reason, HasSubstr("an exception of the plugin"));
  EXPECT_EQ(solveWith("integer", goodWindow()).error().status, RefusalStatus::kNotConverged);
}

TEST(Initializer, RefusesASuccessThatIsNone) {
  const auto nan = solveWith("nan", goodWindow());
  EXPECT_EQ(nan.error().status, RefusalStatus::kNotConverged);
  EXPECT_THAT(nan.error().reason, HasSubstr("v_WB not finite at keyframe 2"));
  const auto few = solveWith("few_states", goodWindow());
  EXPECT_EQ(few.error().status, RefusalStatus::kNotConverged);
  EXPECT_THAT(few.error().reason, HasSubstr("2 states for 3 keyframes"));
  EXPECT_THAT(solveWith("skewed", goodWindow()).error().reason, HasSubstr("no rigid transform"));
}

TEST(Initializer, GivesASilentRefusalAReason) {
  const auto result = solveWith("silent", goodWindow());
  EXPECT_EQ(result.error().status, RefusalStatus::kTooLittleMotion);
  EXPECT_THAT(result.error().reason, HasSubstr("too_little_motion"));
}

}  // namespace
}  // namespace etalon
