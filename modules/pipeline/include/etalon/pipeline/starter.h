#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "etalon/pipeline/keyframe_window.h"

namespace etalon {

/** [pipeline] initializer = auto: at rest one plugin, in motion another. */
constexpr const char* kAutoInitializer = "auto";

/** Section [auto]. */
struct AutoOptions {
  std::string at_rest = "static";
  std::string moving = "etalon";
  /** Of the window, before `moving` is tried: in seconds since the last window that was not known
   * to move, over the window's length. */
  double min_motion_share = 0.0;

  void declare(ParameterSet& parameters);
};

/** The initializers of a pipeline. */
struct PipelineInitializers {
  std::string name;  ///< of `initializer`
  std::shared_ptr<const Initializer> initializer;
  /** Tried first, for a start at rest; null: there is none. */
  std::shared_ptr<const Initializer> at_rest;
  std::string at_rest_name;
};

/**
 * Asks the initializers about one window after the other until one is accepted, and keeps what they
 * said. With `windows_grow` what is accepted must agree with the attempt before (confirm()); where
 * there is none to compare with, the window takes a keyframe sooner (WindowOptions::confirm_after_s).
 *
 * With an initializer for the start at rest: once that has started the odometry, the windows go on;
 * when it refuses one with kTooMuchMotion, and enough of it is in motion, the other one is tried at
 * every keyframe, and what is accepted takes over. The gyro bias of the start is its prior.
 */
class Starter {
 public:
  static constexpr size_t kDetailedAttempts = 40;  ///< ten seconds of keyframes
  static constexpr int kAttemptsWithKnownBiases = 12;

  enum class Outcome { kRefused, kStarts, kTakesOver };
  using MakeProblem = std::function<InitializationProblem(const WindowOptions&)>;

  Starter(PipelineInitializers initializers, const AutoOptions& automatic,
          const WindowOptions& options, const ImuNoiseDensities& noise, bool windows_grow);

  /** An attempt at a window; what was accepted is the last of attempts(). */
  Outcome attempt(KeyframeWindow* window, const MakeProblem& problem);

  /** From the next attempt on the images are later by this, in the IMU's time, than their stamps. */
  void setTimeOffset(double offset_s) { options_.time_offset_s = offset_s; }
  double timeOffset() const { return options_.time_offset_s; }

  /** The biases as the odometry had them when it was lost, at t, with the standard deviations of the
   * worst axes (rad/s, m/s^2), which grow from then on by the biases' random walk, are the prior of
   * the next kAttemptsWithKnownBiases attempts at which the images show enough to judge: no more, as
   * what made the odometry fail may have changed them. */
  void knowBiases(TimeNs t, const ImuBias& bias, double sigma_gyro, double sigma_accel);
  /** Of the last attempt. */
  const BiasPriors& priors() const { return priors_; }

  /** Whether the odometry was started at rest, and the initializer for motion has not taken over
   * yet. */
  bool waitsForMotion() const { return waits_for_motion_; }
  /** Ends the wait for motion: an odometry that reads the IMU itself needs no handover. */
  void endWaitForMotion() { waits_for_motion_ = false; }

  /** Of a refusal that is older than the last kDetailedAttempts, time, status, reason and timings
   * are kept, estimates are not: a pipeline that never starts must not fill the memory. Refusals of
   * the at-rest initializer are here too, but those of a platform that began to move as it was
   * waited for. */
  const std::vector<InitializationAttempt>& attempts() const { return attempts_; }
  /** Of a flight without end only the newest attempts are kept, `keep` at least. */
  void forgetOld(size_t keep);
  /** How many attempts there were: those that are forgotten, too. */
  size_t attemptCount() const { return attempts_forgotten_ + attempts_.size(); }

 private:
  void keep(InitializationAttempt attempt);
  bool startsAtRest(const InitializationProblem& problem);
  bool isInMotion(const KeyframeWindow& window, const InitializationProblem& problem);
  WindowOptions handoverOptions(const KeyframeWindow& window) const;
  WindowOptions startOptions(TimeNs now) const;

  PipelineInitializers initializers_;
  AutoOptions automatic_;
  WindowOptions options_;
  ImuNoiseDensities noise_;
  bool windows_grow_ = false;
  bool waits_for_motion_ = false;
  TimeNs last_rest_ = 0;  ///< last keyframe of the last window that was not known to move
  TimeNs started_at_ = 0;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();  ///< of the start, rad/s
  double sigma_gyro_bias_ = 0.0;                         ///< of the start, of the worst axis, rad/s
  BiasPriors known_;                                     ///< after a loss, as it was at known_at_
  TimeNs known_at_ = 0;
  int attempts_with_known_ = 0;  ///< that are still to come
  BiasPriors priors_;
  std::vector<InitializationAttempt> attempts_;
  size_t attempts_forgotten_ = 0;
};

}  // namespace etalon
