#include "etalon/pipeline/run_configuration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace etalon {
namespace {

using ::testing::ElementsAre;

TEST(InOrderOfDisplay, ThePapersTwoStandSideBySideBeforeTheOthers) {
  EXPECT_THAT(inOrderOfDisplay({"static", "orbslam3_inertial_only", "drt", "eta", "linear"}),
              ElementsAre("eta", "orbslam3_inertial_only", "drt", "linear", "static"));
  EXPECT_THAT(inOrderOfDisplay({"static", "orbslam3_inertial_only", "drt"}),
              ElementsAre("orbslam3_inertial_only", "drt", "static"));
  EXPECT_THAT(inOrderOfDisplay({}), ElementsAre());
}

}  // namespace
}  // namespace etalon
