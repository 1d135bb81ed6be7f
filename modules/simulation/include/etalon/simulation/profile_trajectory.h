#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

enum class MotionProfile {
  kStatic,        ///< at rest throughout
  kGentle,        ///< a calm flight: 0.55 m/s, 0.4 rad/s RMS
  kAggressive,    ///< a brisk flight: 1.15 m/s, 1.0 rad/s RMS
  kPureRotation,  ///< the body's origin stays where it is, the body turns about all axes
};

/** "static", "gentle", "aggressive" or "pure-rotation"; throws ConfigError for another word. */
MotionProfile motionProfileFromName(const std::string& name);

struct ProfileOptions {
  MotionProfile profile = MotionProfile::kGentle;
  std::uint64_t seed = 1;
  TimeNs start = 1'400'000'000'000'000'000;
  double duration_s = 30.0;
  double rest_s = 1.0;      ///< at rest from the start for so long
  double take_off_s = 3.0;  ///< from rest to the full motion
};

/**
 * A made-up flight of a multirotor with EuRoC's body axes (x up, y right, z forward): at rest, then
 * a take-off into seeded sums of sinusoids in x, y, z, yaw, roll and pitch. Roll and pitch follow
 * the horizontal acceleration, as a multirotor's do, with a wobble of their own on top.
 *
 * Closed form: position p = p_0 + w(t) (h e_z + S(t)) with S a sum of sinusoids and w a polynomial
 * step of degree 11 (five continuous derivatives); derivatives by truncated Taylor arithmetic,
 * exact to rounding. Acceleration and angular rate are twice continuously differentiable.
 */
class ProfileTrajectory : public SimulatedTrajectory {
 public:
  /** Throws ConfigError if a duration is negative or not finite, or if `take_off_s` is not
   * positive. */
  explicit ProfileTrajectory(const ProfileOptions& options);

  TrajectoryState at(TimeNs t) const override;

 private:
  struct Sinusoid {
    double amplitude, angular_frequency, phase;  // m or rad; rad/s; rad
  };
  using Axis = std::vector<Sinusoid>;

  ProfileOptions options_;
  double height_ = 0.0;       // of the take-off, m
  double tilt_ = 0.0;         // share of the multirotor's tilt under acceleration
  double heading_ = 0.0;      // yaw at rest, rad
  std::array<Axis, 6> axes_;  // x, y, z (m), yaw, pitch, roll (rad)
};

}  // namespace etalon
