#include "trial/trial_cut.h"

#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace {

using testing::framesOf;
using testing::imuOf;
using testing::readAll;

class TrialCutTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new testing::TemporaryFolder();
    testing::writeTinyRecording(folder_->path());
  }
  static void TearDownTestSuite() { delete folder_; }

  static FaultyCut faulty(const TrialCut& cut, const std::string& text) {
    return faultyCut(cut, parseFaultScenario("fault", text), 1);
  }

  static testing::TemporaryFolder* folder_;
};
testing::TemporaryFolder* TrialCutTest::folder_ = nullptr;

TEST_F(TrialCutTest, DeliversTheSameHeldOrRead) {
  const TrialCut held(folder_->path(), 0.05, 0.15), read(folder_->path(), 0.05, 0.15, 100.0);
  for (int times = 0; times < 2; ++times) {
    const auto a = held.open(), b = read.open();
    testing::expectSameRecording(*a, *b);
    EXPECT_EQ(a->kind(), b->kind());
    EXPECT_EQ(a->imageStamps(), b->imageStamps());
  }
  EXPECT_EQ(framesOf(readAll(*held.open())).size(), 3U);  // 0.05 to 0.20 s, less its jitter
}

TEST_F(TrialCutTest, HeldImagesAreNotCopied) {
  for (const bool held : {true, false}) {
    const TrialCut cut(folder_->path(), 0.0, 0.0, held ? TrialCut::kMostBytes : 100.0);
    const auto one = framesOf(readAll(*cut.open())), two = framesOf(readAll(*cut.open()));
    ASSERT_EQ(one.size(), static_cast<size_t>(testing::kFrames));
    for (size_t i = 0; i < one.size(); ++i)
      EXPECT_EQ(one[i].left.data == two[i].left.data, held) << i;
  }
}

TEST_F(TrialCutTest, AFaultBeginsWithTheFirstMeasurementThatItChanged) {
  for (const double most_bytes : {TrialCut::kMostBytes, 100.0}) {
    const TrialCut cut(folder_->path(), 0.0, 0.0, most_bytes);
    const std::vector<SensorEvent> plain = readAll(*cut.open());
    FaultyCut dark = faulty(cut, "covered from=0.15 for=0.05");
    ASSERT_TRUE(dark.first);
    EXPECT_EQ(stampOf(*dark.first), testing::frameStamp(3));
    EXPECT_EQ(stampOf(plain[dark.same]), testing::frameStamp(3));
    EXPECT_EQ(dark.same + 1 + readAll(*dark.source).size(), plain.size());

    FaultyCut gap = faulty(cut, "dropped from=0.1 for=0.05");
    EXPECT_EQ(stampOf(plain[gap.same]), testing::frameStamp(2));
    EXPECT_EQ(gap.same + 1 + readAll(*gap.source).size(), plain.size() - 1);
  }
}

TEST_F(TrialCutTest, AWrongCalibrationIsThereFromTheBeginning) {
  const TrialCut cut(folder_->path(), 0.0, 0.0);
  EXPECT_EQ(faulty(cut, "calibration baseline_percent=1").same, 0U);
}

TEST_F(TrialCutTest, AFaultAfterTheEndChangesNothing) {
  const TrialCut cut(folder_->path(), 0.0, 0.0);
  const FaultyCut late = faulty(cut, "covered from=5");
  EXPECT_FALSE(late.first);
  EXPECT_FALSE(late.changed_at);
  EXPECT_EQ(late.same, readAll(*cut.open()).size());
}

TEST_F(TrialCutTest, AFaultThatLeavesNothingToTheEndIsAChange) {
  const TrialCut cut(folder_->path(), 0.0, 0.0);
  const FaultyCut ended = faulty(cut, "dropped from=0.2, imu_gap from=0.2");
  EXPECT_FALSE(ended.first);
  ASSERT_TRUE(ended.changed_at);
  EXPECT_GE(*ended.changed_at, testing::frameStamp(4) - 1'000'000);
}

TEST_F(TrialCutTest, AnUnreadableRecordingIsADataError) {
  EXPECT_THROW(TrialCut(folder_->path() + "/none", 0.0, 0.0), DataError);
}

}  // namespace
}  // namespace etalon
