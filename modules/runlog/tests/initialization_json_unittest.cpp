#include "etalon/runlog/initialization_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "etalon/core/errors.h"
#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using testing::exampleRecord;
using ::testing::HasSubstr;

TEST(RunRecordJson, ReadsBackWhatWasWritten) {
  const RunRecord record = exampleRecord();
  const RunRecord read = runRecordFromJson(toJson(record), "test");
  // All but the rotations is read back bit for bit, so writing it again gives the same text.
  const nlohmann::json first = nlohmann::json::parse(toJson(record));
  nlohmann::json second = nlohmann::json::parse(toJson(read));
  for (size_t a = 0; a < record.attempts.size(); ++a)
    for (size_t s = 0; s < record.attempts[a].stages.size(); ++s)
      for (size_t k = 0; k < record.attempts[a].stages[s].states.size(); ++k) {
        auto& state = second["attempts"][a]["stages"][s]["states"][k];
        const SE3& T = record.attempts[a].stages[s].states[k].T_WB;
        // Through a quaternion and back: a few roundings of numbers of size 1.
        EXPECT_LT((read.attempts[a].stages[s].states[k].T_WB.R - T.R).norm(), 2e-15);
        state["q_WB_xyzw"] = first["attempts"][a]["stages"][s]["states"][k]["q_WB_xyzw"];
      }
  EXPECT_EQ(first, second);

  EXPECT_EQ(read.config, record.config);
  EXPECT_EQ(read.initialized_at, record.initialized_at);
  ASSERT_NE(read.acceptedAttempt(), nullptr);
  EXPECT_EQ(read.acceptedAttempt()->t, record.attempts[1].t);
  ASSERT_NE(read.acceptedAttempt()->stage(kStageViBa), nullptr);
  EXPECT_EQ(read.acceptedAttempt()->stage(kStageViBa)->covariance,
            record.attempts[1].stages[1].covariance);
  EXPECT_EQ(read.acceptedAttempt()->stage("another"), nullptr);
  EXPECT_EQ(read.acceptedAttempt()->milliseconds(kTimingInitialize), 3.25);
  EXPECT_TRUE(std::isnan(read.acceptedAttempt()->milliseconds("another")));
}

TEST(RunRecordJson, NaNIsNullAndWhatIsNotThereStaysAway) {
  RunRecord record = exampleRecord();
  const nlohmann::json json = nlohmann::json::parse(toJson(record));
  const auto& stage = json["attempts"][1]["stages"][0];
  EXPECT_TRUE(stage["errors"]["scale_error"].is_null());
  EXPECT_TRUE(json["statistics"]["wall_s"].is_null());
  EXPECT_FALSE(stage.contains("covariance"));
  EXPECT_TRUE(std::isnan(
      runRecordFromJson(toJson(record), "test").attempts[1].stages[0].errors->scale_error));

  record.initialized_at.reset();
  EXPECT_EQ(runRecordFromJson(toJson(record), "test").final_errors->position_m.rmse, 0.004);
  EXPECT_EQ(runRecordFromJson(toJson(record), "test").final_ba->keyframes, 8);
  record.trajectory_errors.reset();
  record.final_errors.reset();
  record.final_ba.reset();
  record.attempts[1].stages[0].errors.reset();
  const RunRecord read = runRecordFromJson(toJson(record), "test");
  EXPECT_FALSE(read.initialized_at.has_value());
  EXPECT_FALSE(read.trajectory_errors.has_value());
  EXPECT_EQ(read.smoothed_errors->position_m.rmse, 0.005);
  EXPECT_FALSE(read.final_errors.has_value());
  EXPECT_FALSE(read.final_ba.has_value());
  EXPECT_FALSE(read.attempts[1].stages[0].errors.has_value());
}

TEST(RunRecordJson, HoldsWhatTheFlightSaidOfTheCalibration) {
  RunRecord record = exampleRecord();
  EXPECT_FALSE(nlohmann::json::parse(toJson(record)).contains("calibration"));
  record.calibration = {
      {"extrinsics", "baseline", "%", "off", "baseline: off", {0.6}, {0.1}, {0.6}}};
  const RunRecord read = runRecordFromJson(toJson(record), "test");
  ASSERT_EQ(read.calibration.size(), 1U);
  EXPECT_EQ(read.calibration[0].quantity, "baseline");
  EXPECT_EQ(read.calibration[0].verdict, "off");
  EXPECT_EQ(read.calibration[0].sigma, std::vector<double>{0.1});
  EXPECT_EQ(read.calibration[0].words, "baseline: off");
}

TEST(RunRecordJson, HoldsTheHandoverAndTheInitializerAtRest) {
  RunRecord record = exampleRecord();
  for (const char* key : {"handed_over_at_ns", "at_rest_initializer"})
    EXPECT_FALSE(nlohmann::json::parse(toJson(record)).contains(key)) << key;
  record.handed_over_at = record.first_image + 5'250'000'000;
  record.at_rest_initializer = "static";
  record.at_rest_initializer_version = "1.0";
  record.at_rest_initializer_path = "/lib/static.so";
  const nlohmann::json json = nlohmann::json::parse(toJson(record));
  EXPECT_EQ(json["handed_over_at_ns"], *record.handed_over_at);
  EXPECT_EQ(json["at_rest_initializer"], "static");
  const RunRecord read = runRecordFromJson(toJson(record), "test");
  EXPECT_EQ(read.handed_over_at, record.handed_over_at);
  EXPECT_EQ(read.at_rest_initializer, "static");
  EXPECT_EQ(read.at_rest_initializer_version, "1.0");
  EXPECT_EQ(read.at_rest_initializer_path, "/lib/static.so");
}

TEST(RunRecordJson, AnEmptyRecordReadsBackToo) {
  const RunRecord read = runRecordFromJson(toJson(RunRecord{}), "test");
  EXPECT_TRUE(read.attempts.empty());
  EXPECT_EQ(read.acceptedAttempt(), nullptr);
}

TEST(StageRecord, KeepsGravityInTheFirstBody) {
  StampedState state;
  state.T_WB.R << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // 90 degrees about x: the body's y points up
  const StageRecord stage = StageRecord::fromStates("init", {state}, {}, 9.8);
  EXPECT_EQ(stage.gravity_B0, Eigen::Vector3d(0, -9.8, 0));
  EXPECT_EQ(StageRecord::fromStates("init", {}, {}, 9.8).gravity_B0, Eigen::Vector3d::Zero());
}

std::string errorOf(const std::string& json) {
  try {
    runRecordFromJson(json, "run.json");
  } catch (const DataError& e) {
    return e.what();
  }
  return "";
}

TEST(RunRecordJson, SaysWhatIsWrongAndWhere) {
  const std::string good = toJson(exampleRecord());
  const auto edited = [&](const std::string& pointer, const nlohmann::json& value) {
    nlohmann::json json = nlohmann::json::parse(good);
    json[nlohmann::json::json_pointer(pointer)] = value;
    return errorOf(json.dump());
  };
  EXPECT_THAT(errorOf("{"), HasSubstr("run.json"));
  EXPECT_THAT(errorOf("{"), HasSubstr("expected JSON"));
  EXPECT_THAT(errorOf("[]"), HasSubstr("etalon run"));
  EXPECT_THAT(edited("/format", "something else"), HasSubstr("etalon run"));
  EXPECT_THAT(edited("/version", 99), HasSubstr("expected version 1"));
  EXPECT_THAT(edited("/attempts", 3), HasSubstr("'/attempts': expected an array"));
  EXPECT_THAT(edited("/attempts/0/stamp_ns", 1.5),
              HasSubstr("'/attempts/0/stamp_ns': expected an integer"));
  EXPECT_THAT(edited("/attempts/1/stages/0/states/2/p_WB_m", {1, 2}),
              HasSubstr("/states/2/p_WB_m': expected 3 numbers"));
  EXPECT_THAT(edited("/attempts/1/stages/0/states/2/q_WB_xyzw", {1, 1, 1, 1}),
              HasSubstr("expected a unit quaternion"));
  EXPECT_THAT(edited("/attempts/1/stages/1/covariance/0", {1}), HasSubstr("square"));
  EXPECT_THAT(edited("/statistics/imu_samples", -1), HasSubstr("expected a count"));
  EXPECT_THAT(edited("/warnings/0", 1), HasSubstr("expected a text"));
  nlohmann::json without = nlohmann::json::parse(good);
  without["attempts"][0].erase("reason");
  EXPECT_THAT(errorOf(without.dump()),
              HasSubstr("'/attempts/0': expected an object with the key 'reason'"));
}

TEST(RunRecordJson, FileHoldsTheText) {
  const testing::TemporaryFolder folder;
  const std::string file = folder / "initialization.json";
  writeInitializationJson(file, exampleRecord());
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_EQ(text, toJson(exampleRecord()));
  EXPECT_THROW(writeInitializationJson(folder / "no/such/folder.json", exampleRecord()), DataError);
}

}  // namespace
}  // namespace etalon
