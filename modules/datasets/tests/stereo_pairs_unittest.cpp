#include "stereo_pairs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "euroc_source_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr TimeNs kMs = 1'000'000;

TEST(StereoPairs, AreOfEqualStampsWithoutATolerance) {
  const StereoPairs found =
      pairByStamps({0, 50 * kMs, 100 * kMs, 150 * kMs}, {50 * kMs, 101 * kMs, 150 * kMs}, 0.0);
  EXPECT_THAT(found.pairs, ElementsAre(Pair(1, 0), Pair(3, 2)));
  EXPECT_THAT(found.alone_left, ElementsAre(0, 2));
  EXPECT_THAT(found.alone_right, ElementsAre(1));
  EXPECT_EQ(describeOffset(found), "");
}

TEST(StereoPairs, OfAConstantOffset) {
  const StereoPairs found =
      pairByStamps({0, 50 * kMs, 100 * kMs, 150 * kMs}, {3 * kMs, 53 * kMs, 103 * kMs}, 0.004);
  EXPECT_THAT(found.pairs, ElementsAre(Pair(0, 0), Pair(1, 1), Pair(2, 2)));
  EXPECT_THAT(found.alone_left, ElementsAre(3));
  EXPECT_DOUBLE_EQ(found.offset_s, 0.003);
  EXPECT_DOUBLE_EQ(found.spread_s, 0.0);
  EXPECT_THAT(describeOffset(found), HasSubstr("are 3 ms after those of the left one"));
}

TEST(StereoPairs, TakeTheNearest) {
  // The tolerance would allow the left image at 0 to have the right one at 9 ms.
  const StereoPairs found =
      pairByStamps({0, 10 * kMs, 20 * kMs}, {9 * kMs, 12 * kMs, 19 * kMs}, 0.010);
  EXPECT_THAT(found.pairs, ElementsAre(Pair(1, 0), Pair(2, 2)));
  EXPECT_THAT(found.alone_left, ElementsAre(0));
  EXPECT_THAT(found.alone_right, ElementsAre(1));
  EXPECT_DOUBLE_EQ(found.offset_s, -0.001);
}

TEST(StereoPairs, OfNothing) {
  EXPECT_THAT(pairByStamps({}, {1, 2}, 1.0).alone_right, ElementsAre(0, 1));
  EXPECT_THAT(pairByStamps({1}, {}, 1.0).pairs, IsEmpty());
  EXPECT_EQ(adviseTolerance({}, {1}), "");
}

TEST(StereoPairs, TheAdvisedToleranceIsEnough) {
  const std::vector<TimeNs> left = {0, 50 * kMs, 100 * kMs};
  const std::vector<TimeNs> right = {3 * kMs + 123'456, 52 * kMs, 104 * kMs + 1};
  EXPECT_THAT(adviseTolerance(left, right), HasSubstr("--pair-tolerance 4.001 (ms) would pair 3"));
  EXPECT_EQ(pairByStamps(left, right, 4.001e-3).pairs.size(), 3u);
}

TEST(StereoPairs, WhereManyAreAloneTheToleranceIsAdvisedThatPairsThem) {
  std::vector<TimeNs> left, right;
  for (TimeNs k = 0; k < 40; ++k) {
    left.push_back(50 * kMs * k);
    right.push_back(left.back() + (k % 4 == 0 ? 0 : 238));  // through a double and back
  }
  EXPECT_THAT(adviseOnAlone(pairByStamps(left, right, 0.0), left, right),
              AllOf(HasSubstr("30 of 40 left images have no right one of the same stamp"),
                    HasSubstr("--pair-tolerance 0.001 (ms) would pair 40")));
  // Nothing is near those that are really missing.
  std::vector<TimeNs> lost;
  for (size_t k = 0; k < right.size(); k += 4) lost.push_back(right[k]);
  EXPECT_EQ(adviseOnAlone(pairByStamps(left, lost, 0.0), left, lost), "");
  right.resize(1);
  EXPECT_EQ(adviseOnAlone(pairByStamps(left, left, 0.0), left, left), "");
}

/** A EuRoC folder whose right images are 3 ms late. */
class LateRightImages : public EurocSource {
 protected:
  LateRightImages() {
    std::string text = "#timestamp [ns],filename\n";
    for (int i = 0; i < kFrames; ++i)
      text +=
          std::to_string(frameStamp(i) + 3 * kMs) + "," + std::to_string(frameStamp(i)) + ".png\n";
    writeText(mav0("cam1/data.csv"), text);
  }
};

TEST_F(LateRightImages, AreRefusedWithWhatWouldPairThem) {
  EXPECT_THAT(openingError(), HasSubstr("no stereo pair was found; expected left and right images "
                                        "with equal stamps; the nearest right stamp is 3 ms"));
  EXPECT_THAT(openingError(), HasSubstr("--pair-tolerance 3.000 (ms)"));
}

TEST_F(LateRightImages, ArePairedWithATolerance) {
  SourceOptions options;
  options.recording.pair_tolerance_s = 0.003;
  const auto source = open(options);
  ASSERT_EQ(source->imageStamps().size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(source->imageStamps()[2], frameStamp(2));
  const LoadedFrame frame = source->loadFrame(2);
  EXPECT_EQ(frame.problem, "");
  EXPECT_THAT(frame.frame.right_path, HasSubstr(std::to_string(frameStamp(2))));
  EXPECT_THAT(source->statistics().warnings,
              ElementsAre(HasSubstr("stamps of the right camera are 3 ms after")));
}

}  // namespace
}  // namespace etalon::testing
