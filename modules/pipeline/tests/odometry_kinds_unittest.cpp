#include "odometry_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

TEST(OdometryKinds, EveryNameIsAKeyAndStereoOdometryNeedsNothingNew) {
  EXPECT_THAT(odometryKinds(), ::testing::ElementsAre(kFixedLag, kStereoVisual));
  EXPECT_EQ(odometryKindsInWords(),
            "fixed_lag (images and IMU, tightly coupled) or stereo_visual (images alone)");
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  PipelineOptions options;
  EXPECT_NE(makeOdometry(calibration, options, nullptr), nullptr);  // by default
  options.odometry_kind = kStereoVisual;
  EXPECT_EQ(makeOdometry(calibration, options, nullptr), nullptr);
}

}  // namespace
}  // namespace etalon
