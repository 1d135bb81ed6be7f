#include "etalon/imu/saturation.h"

#include <algorithm>
#include <cmath>

namespace etalon {

namespace {
/** Two's complement reaches one unit of the last place farther to one side, and what is written in
 * decimals is rounded. */
constexpr double kSame = 1e-4;
}  // namespace

bool SaturationDetector::atTheEnd(double value, int sensor, Axis* axis) {
  const size_t s = sensor;
  const double size = std::abs(value);
  if (given_[s] > 0.0) return size >= (1.0 - kSame) * given_[s];
  axis->run = value == axis->last ? axis->run + 1 : 1;
  axis->last = value;
  largest_[s] = std::max(largest_[s], size);
  if (size > axis->largest) axis->largest = size, axis->times = 0;
  axis->times += size == axis->largest;
  if (size > (1.0 + kSame) * axis->limit) axis->limit = 0.0;
  const double least =
      std::max(sensor == 0 ? kLeastGyroRps : kLeastAccelMps2, (1.0 - kSame) * largest_[s]);
  const bool often = axis->run >= kRun || axis->times >= kTimes;
  if (often && size == axis->largest && size >= least) axis->limit = size;
  return axis->limit > 0.0 && size >= (1.0 - kSame) * axis->limit;
}

bool SaturationDetector::mark(ImuSample* sample) {
  sample->saturated = 0;
  for (int a = 0; a < 3; ++a) {
    const size_t axis = a;
    if (atTheEnd(sample->gyro[a], 0, &axes_[axis])) sample->saturated |= saturatedGyro(a);
    if (atTheEnd(sample->accel[a], 1, &axes_[axis + 3])) sample->saturated |= saturatedAccel(a);
  }
  return sample->saturated != 0;
}

}  // namespace etalon
