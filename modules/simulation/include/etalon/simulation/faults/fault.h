#pragma once

#include <string>
#include <variant>
#include <vector>

#include "etalon/core/parameters.h"

// What can be wrong with a recording: one struct a kind, its members as a fault file names them
// (config/faults.ini). Instants are seconds after the scenario's zero (see withFaults).

namespace etalon {

enum class Lens { kBoth, kLeft, kRight };

/** from_s <= t < from_s + length_s; without limits unless said otherwise. */
struct FaultInterval {
  static constexpr double kUnlimitedS = 1e9;
  double from_s = -kUnlimitedS, length_s = 2.0 * kUnlimitedS;

  bool contains(double s) const { return from_s <= s && s < from_s + length_s; }
  void declare(ParameterSet& parameters);
};

namespace faults {

// Of every kind: its name and the keys at least one of which must be given.
using Keys = std::vector<std::string>;

/** A covered lens: an image of nothing but noise, 0 to 3 grey levels. */
struct Covered {
  static constexpr const char* kName = "covered";
  static Keys needs() { return {}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  void declare(ParameterSet& parameters);
};

/** A camera repeats the last image that it delivered before, bit for bit. */
struct Frozen {
  static constexpr const char* kName = "frozen";
  static Keys needs() { return {}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  void declare(ParameterSet& parameters);
};

/** No pairs of images. */
struct Dropped {
  static constexpr const char* kName = "dropped";
  static Keys needs() { return {}; }
  FaultInterval during;
  void declare(ParameterSet& parameters);
};

/** A share of the pairs of images is lost at random. */
struct Lost {
  static constexpr const char* kName = "lost";
  static Keys needs() { return {"percent"}; }
  FaultInterval during;
  double percent = 0.0;
  void declare(ParameterSet& parameters);
};

/** Only every nth pair of images, counted from the recording's first. */
struct Every {
  static constexpr const char* kName = "every";
  static Keys needs() { return {"n"}; }
  FaultInterval during;
  int n = 1;
  void declare(ParameterSet& parameters);
};

/** No IMU samples. */
struct ImuGap {
  static constexpr const char* kName = "imu_gap";
  static Keys needs() { return {}; }
  FaultInterval during;
  void declare(ParameterSet& parameters);
};

/** The images' stamps are late against the IMU's; a time offset that nobody knows of. */
struct Delay {
  static constexpr const char* kName = "delay";
  static Keys needs() { return {"ms"}; }
  FaultInterval during;
  double ms = 0.0;
  void declare(ParameterSet& parameters);
};

/** The images' stamps vary at random, normally distributed and cut at three sigmas. */
struct Jitter {
  static constexpr const char* kName = "jitter";
  static Keys needs() { return {"ms"}; }
  FaultInterval during;
  double ms = 0.0;  ///< sigma
  void declare(ParameterSet& parameters);
};

/** The clock of all streams, the ground truth's too, jumps ahead. */
struct ClockJump {
  static constexpr const char* kName = "clock_jump";
  static Keys needs() { return {"by"}; }
  double from_s = 0.0, by_s = 0.0;
  void declare(ParameterSet& parameters);
};

/** A step of exposure or gain: grey levels become factor * level + offset, saturated. */
struct Exposure {
  static constexpr const char* kName = "exposure";
  static Keys needs() { return {"factor", "offset"}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  double factor = 1.0, offset = 0.0;
  void declare(ParameterSet& parameters);
};

/** Gaussian blur: out of focus. */
struct Blur {
  static constexpr const char* kName = "blur";
  static Keys needs() { return {"px"}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  double sigma_px = 0.0;
  void declare(ParameterSet& parameters);
};

/** The mean along a line: motion blur of a constant length and direction. */
struct MotionBlur {
  static constexpr const char* kName = "motion_blur";
  static Keys needs() { return {"px"}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  double length_px = 0.0, direction_deg = 0.0;
  void declare(ParameterSet& parameters);
};

/** White noise on the images. */
struct ImageNoise {
  static constexpr const char* kName = "noise";
  static Keys needs() { return {"gray"}; }
  FaultInterval during;
  Lens lens = Lens::kBoth;
  double sigma_gray = 0.0;
  void declare(ParameterSet& parameters);
};

/** The IMU saturates: each axis is held within +- the limit. */
struct ImuLimit {
  static constexpr const char* kName = "imu_limit";
  static Keys needs() { return {"gyro_dps", "accel_mps2"}; }
  FaultInterval during;
  double gyro_dps = 1e9, accel_mps2 = 1e9;
  void declare(ParameterSet& parameters);
};

/** Biases of this magnitude, in random directions, are added to the IMU's; to those of the ground
 * truth, too. */
struct BiasJump {
  static constexpr const char* kName = "bias_jump";
  static Keys needs() { return {"gyro_dps", "accel_mps2"}; }
  FaultInterval during;
  double gyro_dps = 0.0, accel_mps2 = 0.0;
  void declare(ParameterSet& parameters);
};

/** The calibration that is told is wrong, the measurements are not: cameras turned about a random
 * axis (both: the rig about the left one's centre), their focal length, the baseline. */
struct WrongCalibration {
  static constexpr const char* kName = "calibration";
  static Keys needs() { return {"rotation_deg", "focal_percent", "baseline_percent"}; }
  Lens lens = Lens::kBoth;
  double rotation_deg = 0.0, focal_percent = 0.0, baseline_percent = 0.0;
  void declare(ParameterSet& parameters);
};

}  // namespace faults

using Fault =
    std::variant<faults::Covered, faults::Frozen, faults::Dropped, faults::Lost, faults::Every,
                 faults::ImuGap, faults::Delay, faults::Jitter, faults::ClockJump, faults::Exposure,
                 faults::Blur, faults::MotionBlur, faults::ImageNoise, faults::ImuLimit,
                 faults::BiasJump, faults::WrongCalibration>;

}  // namespace etalon
