#include "etalon/imu/imu_noise.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

TEST(ImuNoiseOptions, ScalesWhiteNoiseAndLeavesTheRandomWalks) {
  const ImuNoiseDensities data_sheet;
  ImuNoiseOptions options;
  options.gyro_noise_factor = 2.0;
  options.accel_noise_factor = 8.0;
  const ImuNoiseDensities used = options.apply(data_sheet);
  EXPECT_DOUBLE_EQ(used.gyro_noise_density, 2.0 * data_sheet.gyro_noise_density);
  EXPECT_DOUBLE_EQ(used.accel_noise_density, 8.0 * data_sheet.accel_noise_density);
  EXPECT_EQ(used.gyro_random_walk, data_sheet.gyro_random_walk);
  EXPECT_EQ(used.accel_random_walk, data_sheet.accel_random_walk);
}

}  // namespace
}  // namespace etalon
