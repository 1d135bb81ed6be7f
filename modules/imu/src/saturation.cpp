#include "etalon/imu/saturation.h"

#include <algorithm>
#include <cmath>

namespace etalon {

namespace {
/** Two's complement reaches one unit of the last place farther to one side, and what is written in
 * decimals is rounded. */
constexpr double kSame = 1e-4;
/** Of the samples, those that repeat the one before where a sensor has at most half of the rate. */
constexpr double kHeldShare = 0.3;
constexpr int kFewest = 10;
}  // namespace

bool SaturationDetector::atTheEnd(double value, int sensor, bool held, Axis* axis) {
  const size_t s = sensor;
  const double size = std::abs(value);
  if (given_[s] > 0.0) return size >= (1.0 - kSame) * given_[s];
  if (!held) {
    axis->run = value == axis->last ? axis->run + 1 : 1;
    axis->times += size == axis->largest;
  }
  axis->last = value;
  largest_[s] = std::max(largest_[s], size);
  if (size > axis->largest) axis->largest = size, axis->times = 1;
  if (size > (1.0 + kSame) * axis->limit) axis->limit = 0.0;
  const double least =
      std::max(sensor == 0 ? kLeastGyroRps : kLeastAccelMps2, (1.0 - kSame) * largest_[s]);
  const bool often = axis->run >= kRun || axis->times >= kTimes;
  if (often && size == axis->largest && size >= least) axis->limit = size;
  return axis->limit > 0.0 && size >= (1.0 - kSame) * axis->limit;
}

bool SaturationDetector::Rhythm::isHeld(bool repeated) {
  ++samples;
  repeats += repeated;
  return repeated && samples >= kFewest && repeats > kHeldShare * samples;
}

bool SaturationDetector::mark(ImuSample* sample) {
  sample->saturated = 0;
  const bool gyro_held = rhythms_[0].isHeld(sample->gyro == last_.gyro),
             accel_held = rhythms_[1].isHeld(sample->accel == last_.accel);
  for (int a = 0; a < 3; ++a) {
    const size_t axis = a;
    if (atTheEnd(sample->gyro[a], 0, gyro_held, &axes_[axis]))
      sample->saturated |= saturatedGyro(a);
    if (atTheEnd(sample->accel[a], 1, accel_held, &axes_[axis + 3]))
      sample->saturated |= saturatedAccel(a);
  }
  last_ = *sample;
  return sample->saturated != 0;
}

}  // namespace etalon
