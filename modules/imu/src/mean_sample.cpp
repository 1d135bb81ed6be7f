#include "etalon/imu/mean_sample.h"

namespace etalon {

ImuSample meanSample(const std::vector<ImuSample>& samples) {
  ImuSample mean;
  for (const ImuSample& sample : samples) {
    mean.gyro += sample.gyro / static_cast<double>(samples.size());
    mean.accel += sample.accel / static_cast<double>(samples.size());
  }
  return mean;
}

}  // namespace etalon
