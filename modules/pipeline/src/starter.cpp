#include "etalon/pipeline/starter.h"

#include <algorithm>
#include <cmath>

#include "etalon/pipeline/nested_windows.h"

namespace etalon {

void AutoOptions::declare(ParameterSet& parameters) {
  parameters.add(
      "at_rest", &at_rest,
      "With [pipeline] initializer = auto: the plugin that starts the odometry while the "
      "platform stands still. It must refuse motion with too_much_motion, as static does.");
  parameters.add("moving", &moving,
                 "With [pipeline] initializer = auto: the plugin that takes over when motion "
                 "begins, or starts the odometry in motion.");
  parameters.add("min_motion_share", &min_motion_share, {0.0, 1.0},
                 "Share of the window's time that must be in motion before the one for motion is "
                 "tried; 0: as soon as the window is not at rest.");
}

namespace {

bool seesTooLittle(const InitializationAttempt& attempt) {
  return !attempt.accepted() && attempt.decision.error().status == RefusalStatus::kTooFewTracks;
}

}  // namespace

Starter::Starter(PipelineInitializers initializers, const AutoOptions& automatic,
                 const WindowOptions& options, const ImuNoiseDensities& noise, bool windows_grow)
    : initializers_(std::move(initializers)),
      automatic_(automatic),
      options_(options),
      noise_(noise),
      windows_grow_(windows_grow) {}

Starter::Outcome Starter::attempt(KeyframeWindow* window, const MakeProblem& make_problem) {
  const bool takes_over = waits_for_motion_;
  const WindowOptions options =
      takes_over ? handoverOptions(*window) : startOptions(window->stamps().back());
  priors_ = options.priors;
  const InitializationProblem problem = make_problem(options);
  if (takes_over) {
    if (!isInMotion(*window, problem)) return Outcome::kRefused;
  } else if (initializers_.at_rest && startsAtRest(problem)) {
    return Outcome::kStarts;
  }
  InitializationAttempt attempt =
      attemptInitialization(problem, *initializers_.initializer, options);
  if (initializers_.at_rest) attempt.initializer = initializers_.name;
  if (windows_grow_ &&
      !confirm(attempts_.empty() ? nullptr : &attempts_.back(), options.acceptance, &attempt) &&
      options.confirm_after_s > 0.0)
    window->takeSooner(options.confirm_after_s);
  if (attempts_with_known_ > 0 && !seesTooLittle(attempt)) --attempts_with_known_;
  keep(std::move(attempt));
  if (!attempts_.back().accepted()) return Outcome::kRefused;
  waits_for_motion_ = false;
  return takes_over ? Outcome::kTakesOver : Outcome::kStarts;
}

void Starter::knowBiases(TimeNs t, const ImuBias& bias, double sigma_gyro, double sigma_accel) {
  known_ = options_.priors;
  known_.mean = bias;
  known_.sigma_gyro_rps = sigma_gyro;
  known_.sigma_accel_mps2 = sigma_accel;
  known_at_ = t;
  attempts_with_known_ = kAttemptsWithKnownBiases;
}

WindowOptions Starter::startOptions(TimeNs now) const {
  WindowOptions options = options_;
  if (attempts_with_known_ == 0) return options;
  const double walked = std::sqrt(std::max(0.0, secondsBetween(known_at_, now)));
  const auto grown = [walked](double sigma, double walk, double most) {
    return std::min(std::hypot(sigma, walk * walked), most);
  };
  BiasPriors& priors = options.priors;
  priors.mean = known_.mean;
  priors.sigma_gyro_rps =
      grown(known_.sigma_gyro_rps, noise_.gyro_random_walk, priors.sigma_gyro_rps);
  priors.sigma_accel_mps2 =
      grown(known_.sigma_accel_mps2, noise_.accel_random_walk, priors.sigma_accel_mps2);
  return options;
}

/** Adds the attempt, and drops the estimates of the one that is now too old to keep them. */
void Starter::keep(InitializationAttempt attempt) {
  attempts_.push_back(std::move(attempt));
  if (attempts_.size() <= kDetailedAttempts) return;
  InitializationAttempt& old = attempts_[attempts_.size() - 1 - kDetailedAttempts];
  if (!old.accepted()) old.dropEstimates();
}

void Starter::forgetOld(size_t keep) {
  if (attempts_.size() < 2 * keep) return;
  const std::ptrdiff_t old = attempts_.size() - keep;
  attempts_.erase(attempts_.begin(), attempts_.begin() + old);
  attempts_forgotten_ += old;
}

/** True if the window is at rest: then the odometry runs, and there is nothing else to do. */
bool Starter::startsAtRest(const InitializationProblem& problem) {
  InitializationAttempt attempt = attemptInitialization(problem, *initializers_.at_rest, options_);
  attempt.initializer = initializers_.at_rest_name;
  keep(std::move(attempt));
  const InitializationAttempt& kept = attempts_.back();
  if (!kept.accepted()) return false;
  waits_for_motion_ = true;
  last_rest_ = started_at_ = kept.t;
  gyro_bias_ = kept.bias().gyro;
  sigma_gyro_bias_ = kept.sigmaGyroBias();
  return true;
}

/** Whether the window is known to move, and long enough. A window of which the at-rest initializer
 * cannot tell is an attempt, so that the reason for waiting is seen. */
bool Starter::isInMotion(const KeyframeWindow& window, const InitializationProblem& problem) {
  InitializationResult result = initializers_.at_rest->initialize(problem);
  const TimeNs now = window.stamps().back();
  if (!result && result.error().status == RefusalStatus::kTooMuchMotion)
    return secondsBetween(last_rest_, now) >=
           automatic_.min_motion_share * secondsBetween(window.stamps().front(), now);
  last_rest_ = now;
  if (result) return false;
  InitializationAttempt attempt;
  attempt.t = now;
  attempt.initializer = initializers_.at_rest_name;
  attempt.keyframes.assign(window.stamps().begin(), window.stamps().end());
  attempt.decision = refuse(result.error());
  attempt.init = std::move(result);
  keep(std::move(attempt));
  return false;
}

/** What the start learnt of the gyro bias is the prior, unless the windows have measurements in
 * common, which would count twice. Of the accelerometer's bias it learnt nothing apart from tilt.
 */
WindowOptions Starter::handoverOptions(const KeyframeWindow& window) const {
  WindowOptions options = options_;
  if (window.stamps().front() < started_at_) return options;
  const double walk =
      noise_.gyro_random_walk * std::sqrt(secondsBetween(started_at_, window.stamps().back()));
  const double sigma = std::hypot(sigma_gyro_bias_, walk);
  if (!(sigma < options.priors.sigma_gyro_rps)) return options;
  options.priors.mean.gyro = gyro_bias_;
  options.priors.sigma_gyro_rps = sigma;
  return options;
}

}  // namespace etalon
