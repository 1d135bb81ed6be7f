#include "odometry_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

TEST(OdometryKinds, EveryNameIsAKeyAndMakesAnOdometry) {
  EXPECT_THAT(odometryKinds(), ::testing::ElementsAre(kFixedLag, kStereoVisual));
  EXPECT_EQ(odometryKindsInWords(),
            "fixed_lag (images and IMU, tightly coupled) or stereo_visual (images alone)");
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  const PipelineOptions options;
  EXPECT_EQ(options.odometry_kind, kFixedLag);
  TrackedFrame nothing;
  for (const std::string& kind : odometryKinds())
    EXPECT_EQ(makeOdometry(kind, calibration, options)->start({}, nothing).inertial,
              kind == kFixedLag);
  EXPECT_THROW(makeOdometry("none", calibration, options), ConfigError);
}

}  // namespace
}  // namespace etalon
