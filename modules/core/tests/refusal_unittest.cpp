#include "etalon/core/refusal.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <set>
#include <string>

namespace etalon {
namespace {

Expected<int> half(int n) {
  if (n % 2 != 0) return refuse(RefusalStatus::kInvalidInput, Value(n), " is odd");
  return n / 2;
}

TEST(Refusal, IsCarriedInPlaceOfAValue) {
  EXPECT_EQ(half(4).value(), 2);
  const Expected<int> refused = half(5);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().status, RefusalStatus::kInvalidInput);
  EXPECT_EQ(refused.error().reason, "5 is odd");
  EXPECT_EQ(refused.error().value, 5.0);
  EXPECT_FALSE(refused.error().bound);  // there is none, so none is made up
}

TEST(Refusal, PrintsEveryPieceByItsType) {
  const std::size_t landmarks = 12;
  const Refusal refusal =
      refuse(RefusalStatus::kTooFewTracks, "of ", landmarks, " landmarks ", Value(0.12345, 2),
             std::string(" agree in keyframe "), 3, ", at least ", Bound(0.5), " is wanted")
          .value();
  EXPECT_EQ(refusal.reason, "of 12 landmarks 0.12 agree in keyframe 3, at least 0.5 is wanted");
  EXPECT_EQ(refusal.value, 0.12345);  // not what is printed
  EXPECT_EQ(refusal.bound, 0.5);
}

TEST(Refusal, PrintsWhatIsNotFinite) {
  EXPECT_EQ(Number(std::numeric_limits<double>::infinity(), 2).text, "inf");
  EXPECT_EQ(Number(std::numeric_limits<double>::quiet_NaN()).text, "nan");
  EXPECT_EQ(Number(-1.0, 0).text, "-1");
}

TEST(Refusal, EveryStatusHasANameOfItsOwn) {
  std::set<std::string> names;
  for (int i = 0; i <= static_cast<int>(RefusalStatus::kTooMuchMotion); ++i)
    names.insert(toString(static_cast<RefusalStatus>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(RefusalStatus::kTooMuchMotion) + 1);
  EXPECT_EQ(names.count("unknown"), 0U);
}

}  // namespace
}  // namespace etalon
