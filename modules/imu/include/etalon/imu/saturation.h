#pragma once

#include <array>

#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * Marks what an IMU measured at the end of its range (ImuSample::saturated), axis by axis.
 *
 * The range is the one that was given, or is learnt: exactly the same value, the largest magnitude
 * that the sensor has shown, kRun times in a row or kTimes in all, above what a platform at rest
 * shows (kLeastGyroRps, kLeastAccelMps2: there quantised noise repeats its values). From then on
 * every sample that has it is marked, whatever the sign. A larger value shows that it was no limit,
 * and the range is unknown again. Noise makes neighbouring samples differ, so that a motion of
 * constant rate is no such run. Where many samples repeat all three axes of the one before, the
 * sensor is slower than the stream (an accelerometer with a fifth of the gyro's rate), and what is
 * repeated counts once.
 */
class SaturationDetector {
 public:
  static constexpr int kRun = 4, kTimes = 6;
  static constexpr double kLeastGyroRps = 0.5;
  static constexpr double kLeastAccelMps2 = 11.0;

  /** Full-scale ranges; 0: to be learnt. */
  explicit SaturationDetector(double gyro_range_rps = 0.0, double accel_range_mps2 = 0.0)
      : given_{gyro_range_rps, accel_range_mps2} {}

  /** Samples in time order. @return whether any axis is marked */
  bool mark(ImuSample* sample);

 private:
  struct Axis {
    double last = 0.0;     ///< value of the sample before
    int run = 1;           ///< samples that have had it
    double largest = 0.0;  ///< magnitude
    int times = 0;         ///< that it was measured
    double limit = 0.0;    ///< learnt; 0: none
  };
  /** How often a sensor measures anew. */
  struct Rhythm {
    int samples = 0, repeats = 0;
    bool isHeld(bool repeated);
  };
  /** Sensor 0: gyro; 1: accelerometer. */
  bool atTheEnd(double value, int sensor, bool held, Axis* axis);

  std::array<double, 2> given_, largest_{};
  std::array<Axis, 6> axes_;
  std::array<Rhythm, 2> rhythms_;
  ImuSample last_;
};

}  // namespace etalon
