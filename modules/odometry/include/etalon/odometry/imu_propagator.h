#pragma once

#include <optional>

#include "etalon/core/calibration.h"
#include "etalon/core/nav_state.h"
#include "etalon/imu/imu_buffer.h"

namespace etalon {

/** The state between frames and ahead of the last one, by the IMU from the last estimate. */
class ImuPropagator {
 public:
  /** @param max_gap_s samples that are further apart, because the clock jumped or some are missing,
   * have nothing between them: no state is known until an estimate after them */
  ImuPropagator(const ImuNoiseDensities& noise, double gravity_mps2, double max_gap_s)
      : noise_(noise), g_W_(0.0, 0.0, -gravity_mps2), max_gap_s_(max_gap_s) {}

  /** Forgets the state, because the odometry ended; keeps samples for the next estimate. */
  void forgetState() {
    state_.reset();
    ahead_.reset();
  }

  /** Nothing leads from the samples so far to those that come: no state is known until an estimate
   * after them. */
  void clockJumped();

  /** The estimate at `t`; samples after it may have come already. */
  void correct(TimeNs t, const NavState& state);

  /** The next sample, later than the one before. */
  void add(const ImuSample& sample);

  /** Stamp of the last sample, or of the last estimate where that is later. */
  TimeNs end() const;

  /** The state at `t`, from the last estimate's stamp to end(); nothing outside of that, before the
   * first estimate, or where the IMU does not cover the time since or has a gap in it. */
  std::optional<NavState> at(TimeNs t) const;

 private:
  /** The state at t1 from that at t0; nothing where the IMU does not cover the time between. */
  std::optional<NavState> integrated(const NavState& from, TimeNs t0, TimeNs t1) const;
  /** Takes ahead_ to the last sample. */
  void carryOn();

  /** Of these, samples are kept; with more, the last state takes the place of the estimate. */
  static constexpr size_t kMostSamples = 4000;

  ImuNoiseDensities noise_;
  Eigen::Vector3d g_W_;
  double max_gap_s_;
  ImuBuffer imu_;  ///< without a gap
  std::optional<NavState> state_;
  TimeNs t_ = 0;  ///< of state_
  /** The state at end(), carried on from sample to sample, so that asking for it costs no more the
   * longer ago the estimate was. */
  std::optional<NavState> ahead_;
  TimeNs ahead_t_ = 0;  ///< of ahead_
};

}  // namespace etalon
