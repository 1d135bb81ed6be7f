#include "etalon/core/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kStart = 1'403'636'579'763'555'584;  // a EuRoC stamp: a double could not hold it

/** Constant rate and constant acceleration, which the interpolation gives back exactly. */
StampedState stateAt(TimeNs t) {
  const double s = secondsBetween(kStart, t);
  const Vector3d a(1, -2, 0.5), v0(0.3, 0.2, -0.1);
  StampedState state;
  state.t = t;
  state.T_WB.R = expSO3({0.3, 1.0, -0.5}) * expSO3(s * Vector3d(0.7, -0.4, 1.1));
  state.T_WB.t = Vector3d(1, 2, 3) + s * v0 + 0.5 * s * s * a;
  state.v_WB = v0 + s * a;
  state.bias.gyro = Vector3d(0.01, 0.02, 0.03) + s * Vector3d(0.001, 0, 0);
  state.bias.accel = Vector3d(0.1, 0.2, 0.3) + s * Vector3d(0, 0.01, 0);
  return state;
}

GroundTruth groundTruth(const std::vector<TimeNs>& stamps) {
  GroundTruth truth;
  for (TimeNs t : stamps) truth.states.push_back(stateAt(t));
  truth.has_velocity = truth.has_biases = true;
  return truth;
}

TEST(GroundTruth, InterpolatesMotionOfConstantRateAndAcceleration) {
  const GroundTruth truth = groundTruth({kStart, kStart + 5 * kMs, kStart + 95 * kMs});
  for (TimeNs t : {kStart + 1, kStart + 3 * kMs, kStart + 40 * kMs, kStart + 95 * kMs - 1}) {
    const auto state = truth.at(t);
    ASSERT_TRUE(state.has_value());
    const StampedState expected = stateAt(t);
    EXPECT_EQ(state->t, t);
    EXPECT_TRUE(state->T_WB.R.isApprox(expected.T_WB.R, 1e-14));
    EXPECT_TRUE(state->T_WB.t.isApprox(expected.T_WB.t, 1e-14));
    EXPECT_TRUE(state->v_WB.isApprox(expected.v_WB, 1e-14));
    EXPECT_TRUE(state->bias.gyro.isApprox(expected.bias.gyro, 1e-14));
    EXPECT_TRUE(state->bias.accel.isApprox(expected.bias.accel, 1e-14));
  }
}

TEST(GroundTruth, GivesRecordedStatesAsTheyAre) {
  const GroundTruth truth = groundTruth({kStart, kStart + 5 * kMs, kStart + 10 * kMs});
  for (const StampedState& recorded : truth.states) {
    const auto state = truth.at(recorded.t);
    ASSERT_TRUE(state.has_value());
    EXPECT_EQ(state->T_WB.R, recorded.T_WB.R);
    EXPECT_EQ(state->T_WB.t, recorded.T_WB.t);
  }
}

TEST(GroundTruth, InterpolatesPositionsLinearlyWithoutVelocities) {
  GroundTruth truth = groundTruth({kStart, kStart + 100 * kMs});
  truth.has_velocity = false;
  const auto state = truth.at(kStart + 25 * kMs);
  ASSERT_TRUE(state.has_value());
  const Vector3d expected = 0.75 * truth.states[0].T_WB.t + 0.25 * truth.states[1].T_WB.t;
  EXPECT_TRUE(state->T_WB.t.isApprox(expected, 1e-14));
}

TEST(GroundTruth, SaysNothingOutsideTheRecordingOrInAGap) {
  const GroundTruth truth = groundTruth({kStart, kStart + 5 * kMs, kStart + 205 * kMs});
  EXPECT_FALSE(truth.at(kStart - 1).has_value());
  EXPECT_FALSE(truth.at(kStart + 205 * kMs + 1).has_value());
  EXPECT_FALSE(truth.at(kStart + 100 * kMs).has_value());
  EXPECT_TRUE(truth.at(kStart + 100 * kMs, 0.3).has_value());
  EXPECT_TRUE(truth.at(kStart + 205 * kMs).has_value());  // recorded, though a gap lies before it
  EXPECT_FALSE(GroundTruth().at(kStart).has_value());
}

/** A folder of this test's own, removed afterwards. */
class Tum : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("etalon_trajectory_") + test->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path() const { return (folder_ / "trajectory.tum").string(); }
  void write(const std::string& text) const { std::ofstream(path()) << text; }

  void expectError(const std::string& text, int line) const {
    write(text);
    try {
      readTum(path());
      ADD_FAILURE() << "accepted: " << text;
    } catch (const DataError& error) {
      EXPECT_EQ(error.file(), path());
      EXPECT_EQ(error.line(), line) << text;
      EXPECT_THAT(error.what(), HasSubstr("expected"));
    }
  }

  std::filesystem::path folder_;
};

TEST_F(Tum, AByteOrderMarkIsNoPartOfTheFile) {
  write(
      "\xEF\xBB\xBF"
      "1.5 0 0 0 0 0 0 1\n");
  EXPECT_EQ(readTum(path()).size(), 1u);
}

TEST_F(Tum, ReadsBackWhatWasWritten) {
  Trajectory written;
  const std::vector<Vector3d> rotations = {
      {0, 0, 0}, {0.3, -1.2, 0.8}, {0, 0, M_PI}, {1.8, 2.5, 0}};
  for (size_t k = 0; k < rotations.size(); ++k) {
    StampedPose pose;
    pose.t = kStart + static_cast<TimeNs>(k) * 50 * kMs + 1;
    pose.T_WB = SE3(expSO3(rotations[k]),
                    Vector3d(-1.5, 1e-3, 123.456789012) * (1.0 + static_cast<double>(k)));
    written.push_back(pose);
  }
  writeTum(path(), written);
  const Trajectory read = readTum(path());
  ASSERT_EQ(read.size(), written.size());
  for (size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].t, written[k].t);  // to the nanosecond
    // Nine decimals: 0.5e-9 an entry; a rotation is twice its quaternion's error.
    EXPECT_LT((read[k].T_WB.t - written[k].T_WB.t).cwiseAbs().maxCoeff(), 0.51e-9);
    EXPECT_LT(logSO3(read[k].T_WB.R.transpose() * written[k].T_WB.R).norm(), 2.1e-9);
  }
}

TEST_F(Tum, WritesTheDocumentedColumns) {
  StampedPose pose;
  pose.t = 5'000'000'042;
  pose.T_WB = SE3(expSO3({0, 0, M_PI_2}), Vector3d(1, -2, 3));
  writeTum(path(), {pose});
  std::ifstream in(path());
  std::string comment, line;
  std::getline(in, comment);
  std::getline(in, line);
  EXPECT_EQ(comment.front(), '#');
  EXPECT_EQ(line,
            "5.000000042 1.000000000 -2.000000000 3.000000000 "
            "0.000000000 0.000000000 0.707106781 0.707106781");
}

TEST_F(Tum, SaysWhichPosesTheyAre) {
  writeTum(path(), Trajectory(1), "T_VB, V somewhere");
  std::ifstream file(path());
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "# T_VB, V somewhere: timestamp[s] x y z[m] qx qy qz qw");
  EXPECT_EQ(readTum(path()).size(), 1u);
}

TEST_F(Tum, ReadsWhatOtherToolsWrite) {
  write(
      "# a comment\r\n\r\n"
      "1.5 1 2 3 0 0 0 1\r\n"
      "2 1 2 3 0 0 0 -1\n"
      "1.403636579763555584e+09 1e-3 2 3 0 0 0.70710 0.70711\n"
      "1403636580.123456789 1 2 3 0.5 0.5 0.5 0.5");
  const Trajectory read = readTum(path());
  ASSERT_EQ(read.size(), 4u);
  EXPECT_EQ(read[0].t, 1'500'000'000);
  EXPECT_EQ(read[1].t, 2'000'000'000);
  EXPECT_EQ(read[2].t, kStart);
  EXPECT_EQ(read[3].t, 1'403'636'580'123'456'789);
  EXPECT_TRUE(read[1].T_WB.R.isIdentity(1e-15));  // q and -q are one rotation
  // A quaternion of five digits is normalised.
  EXPECT_LT((read[2].T_WB.R.transpose() * read[2].T_WB.R - Eigen::Matrix3d::Identity()).norm(),
            1e-14);
}

TEST_F(Tum, NamesTheBrokenLine) {
  const std::string good = "1.0 1 2 3 0 0 0 1\n";
  expectError(good + "2.0 1 2 3 0 0 0\n", 2);               // a column short
  expectError(good + "2.0 1 2 3 0 0 0 1 7\n", 2);           // one too many
  expectError(good + "# comment\n2.0 1 x 3 0 0 0 1\n", 3);  // not a number
  expectError(good + "2.0 1 nan 3 0 0 0 1\n", 2);
  expectError(good + "2.0 1 2 3 0 0 0 0.5\n", 2);  // not a unit quaternion
  expectError(good + "2.0 1 2 3 0 0 0 0\n", 2);
  expectError(good + "1.0 1 2 3 0 0 0 1\n", 2);   // duplicate stamp
  expectError(good + "0.5 1 2 3 0 0 0 1\n", 2);   // backwards
  expectError(good + "1,5 1 2 3 0 0 0 1\n", 2);   // a decimal comma
  expectError(good + "-2.0 1 2 3 0 0 0 1\n", 2);  // the sensor clock has no negative time
  expectError(good + ".5 1 2 3 0 0 0 1\n", 2);
  expectError("1e400 1 2 3 0 0 0 1\n", 1);
  expectError("9999999999.5 1 2 3 0 0 0 1\n", 1);         // beyond 64 bits of nanoseconds
  expectError("1403636579763555584 1 2 3 0 0 0 1\n", 1);  // nanoseconds in place of seconds
}

TEST_F(Tum, SaysWhatIsWrongWithFilesOfOtherPrograms) {
  const auto errorOf = [this](const std::string& text) {
    write(text);
    try {
      readTum(path());
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(errorOf("1403636579763555584 1 2 3 0 0 0 1\n"),
              HasSubstr("found '1403636579763555584'; is it in nanoseconds?"));
  EXPECT_THAT(errorOf("1.5,1,2,3,0,0,0,1\n"), HasSubstr("with blanks, not commas"));
  EXPECT_THAT(errorOf("1.5 1 2 3 0 0 0\n"), HasSubstr("8 numbers: t[s] x y z qx qy qz qw"));
}

TEST_F(Tum, SaysWhichFileCannotBeUsed) {
  for (const std::string& file :
       {(folder_ / "missing.tum").string(), folder_.string()}) {  // absent, a folder
    try {
      readTum(file);
      ADD_FAILURE() << "read " << file;
    } catch (const DataError& error) {
      EXPECT_EQ(error.file(), file);
    }
  }
  EXPECT_THROW(writeTum((folder_ / "missing" / "t.tum").string(), {}), DataError);
  EXPECT_THROW(writeTum(folder_.string(), {}), DataError);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_THROW(writeTum("/dev/full", Trajectory(1)), DataError);
  }
}

TEST(CarriedAlong, BetterPosesTakeTheirNeighboursAlong) {
  Trajectory trajectory, better;
  for (int k = 0; k < 9; ++k)
    trajectory.push_back({k * kMs, SE3(expSO3({0, 0, 0.1 * k}), Vector3d(k, 0, 0))});
  const SE3 left(expSO3({0, 0, 0.2}), Vector3d(0, 1, 0)),
      right(Eigen::Matrix3d::Identity(), {0, 3, 0});
  better.push_back({2 * kMs, left * trajectory[2].T_WB});
  better.push_back({5 * kMs + 1, SE3()});  // no pose of the trajectory
  better.push_back({6 * kMs, right * trajectory[6].T_WB});
  const Trajectory carried = carriedAlong(trajectory, better);
  ASSERT_EQ(carried.size(), trajectory.size());
  const auto expectPose = [&](size_t k, const SE3& T) {
    EXPECT_LT((carried[k].T_WB.R - T.R).norm() + (carried[k].T_WB.t - T.t).norm(), 1e-12) << k;
  };
  for (const size_t k : {0U, 1U, 2U}) expectPose(k, left * trajectory[k].T_WB);
  for (const size_t k : {6U, 7U, 8U}) expectPose(k, right * trajectory[k].T_WB);
  // In the middle of both: half way between where the two would have it.
  const SE3 a = left * trajectory[4].T_WB, b = right * trajectory[4].T_WB;
  expectPose(4, SE3(a.R * expSO3(0.5 * logSO3(a.R.transpose() * b.R)), 0.5 * (a.t + b.t)));
  EXPECT_EQ(carriedAlong(trajectory, {})[4].T_WB.t, trajectory[4].T_WB.t);
  EXPECT_TRUE(carriedAlong({}, better).empty());
}

}  // namespace
}  // namespace etalon
