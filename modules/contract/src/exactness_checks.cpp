#include <algorithm>
#include <cmath>

#include "check_tools.h"
#include "etalon/core/angles.h"
#include "etalon/core/statistics.h"

namespace etalon::contract {

namespace {

using Eigen::Vector3d;

/**
 * Bounds for noise-free data: a hundredth of what the noise of a window of 2.25 s makes unavoidable
 * (the Cramer-Rao bounds are 0.0125 deg, 1.7 mm, 0.0057 m/s, 7e-4 rad/s, 0.37 deg), so that what is
 * left of a method's errors is its data's. b_a: what turns gravity by its bound.
 */
std::vector<Bounded> exactness(const WindowErrors& e) {
  return {{"RRE", "deg", e.rre_deg, 1e-4},          {"ATE", "m", e.ate_m, 2e-5},
          {"gravity", "deg", e.gravity_deg, 0.005}, {"velocity", "m/s", e.velocity_mps, 1e-4},
          {"b_g", "rad/s", e.gyro_bias_rps, 1e-5},  {"b_a", "m/s^2", e.accel_bias_mps2, 1e-3}};
}

/** Median distance of the estimated landmarks from the true ones in the first keyframe's body
 * frame, m; 0 if there are none. */
double medianLandmarkError(const Initialization& result, const SyntheticWindow& window) {
  const SE3 T_B0W_estimated = result.states.front().T_WB.inverse();
  const SE3 T_B0W_true = window.truth.front().T_WB.inverse();
  std::vector<double> errors;
  for (const auto& [id, p_W] : result.landmarks) {
    if (id < 0 || static_cast<size_t>(id) >= window.landmarks.size()) return INFINITY;
    const Vector3d truth = T_B0W_true * window.landmarks[id];
    errors.push_back((T_B0W_estimated * p_W - truth).norm());
  }
  return errors.empty() ? 0.0 : median(std::move(errors));
}

ContractCheck exactOn(Motion motion, const Initializer& initializer) {
  SyntheticWindowOptions options;
  options.motion = motion;
  const Trial trial(options);
  const Answer answer = ask(initializer, trial.problem());
  if (!answer.broken.empty()) return failed(answer.broken);
  if (!answer.result) return refused(answer.result.error());
  std::vector<Bounded> errors =
      exactness(errorsOf(answer.result->states, answer.result->bias, trial.window));
  // A tenth of a pixel at 3 m and EuRoC's baseline is eighteen times that.
  if (!answer.result->landmarks.empty())
    errors.push_back({"landmarks", "m", medianLandmarkError(*answer.result, trial.window), 1e-3});
  if (anyExceeded(errors))
    return failed(describe(errors) + hintAtCause(*answer.result, trial.window));
  return passed(describe(errors));
}

/** The six motions with these biases; `judge` says what is wrong with an answer (empty: nothing).
 * Refused only if all six are. */
class BiasTrials {
 public:
  /** Returns errors with their bounds. */
  using Judge = std::function<std::vector<Bounded>(const Initialization&, const SyntheticWindow&)>;

  BiasTrials(const Initializer& initializer, const Judge& judge)
      : initializer_(initializer), judge_(judge) {}

  /** @param which of the biases, for messages; may be empty */
  void run(const ImuBias& bias, const BiasPriors& priors, const std::string& which = "") {
    for (const Motion motion : testing::kAllMotions) {
      SyntheticWindowOptions options;
      options.motion = motion;
      options.bias = bias;
      options.priors = priors;
      const Trial trial(options);
      const Answer answer = ask(initializer_, trial.problem());
      const std::string where = toString(motion) + which;
      if (!answer.broken.empty()) {
        complaints_.add(where, answer.broken);
        continue;
      }
      if (!answer.result) {
        refusal_ = answer.result.error();
        continue;
      }
      ++answered_;
      const std::vector<Bounded> errors = judge_(*answer.result, trial.window);
      if (anyExceeded(errors))
        complaints_.add(where, describe(errors) + hintAtCause(*answer.result, trial.window),
                        worstShare(errors));
    }
  }

  ContractCheck verdict(const std::string& praise, double value) const {
    if (!complaints_.empty()) return complaints_.verdict();
    if (answered_ == 0) return refused(refusal_);
    return passed(format("%d windows: ", answered_) + praise, value);
  }

 private:
  const Initializer& initializer_;
  Judge judge_;
  int answered_ = 0;
  Complaints complaints_;
  Refusal refusal_;
};

constexpr double kGyroBias[] = {0.02, -0.06, 0.04};  // rad/s; EuRoC has 0.02 to 0.08
constexpr double kAccelBias[] = {0.1, -0.08, 0.12};  // m/s^2; EuRoC has 0.07 to 0.2
constexpr double kShareOfGyroBias = 0.02;            // lost to a prior of sigma 0.1 rad/s

ContractCheck followsGyroBias(const Initializer& initializer, const ContractOptions&) {
  const ImuBias plus{Vector3d(kGyroBias), Vector3d::Zero()};
  const ImuBias minus{-plus.gyro, Vector3d::Zero()};
  double worst = 0.0;
  BiasTrials trials(initializer, [&](const auto& result, const auto& window) {
    const double error = errorsOf(result.states, result.bias, window).gyro_bias_rps;
    worst = std::max(worst, error);
    return std::vector<Bounded>{{"b_g", "rad/s", error, kShareOfGyroBias * plus.gyro.norm()}};
  });
  trials.run(plus, BiasPriors());
  trials.run(minus, BiasPriors(), ", opposite bias");
  return trials.verdict(
      format("b_g of %.3f rad/s and its opposite found to %.2g rad/s (bound %.2g)",
             plus.gyro.norm(), worst, kShareOfGyroBias * plus.gyro.norm()),
      worst);
}

/**
 * Bounds for a b_a that the prior does not know. A method may estimate it or leave it at the prior:
 * either way b_a may not become worse than the prior mean, nor point the other way, gravity may not
 * turn by more than |b_a|/g, and velocities may not run away by more than b_a does in half the
 * window. 5 % on top, since b_a is no infinitesimal.
 */
std::vector<Bounded> accelBounds(const Initialization& result, const SyntheticWindow& window,
                                 double window_s) {
  constexpr double kGravity = 9.81;  // m/s^2, of SyntheticWindowOptions
  const double size = window.bias.accel.norm();
  const WindowErrors e = errorsOf(result.states, result.bias, window);
  const double opposite = -result.bias.accel.dot(window.bias.accel) / size;
  return {{"b_a", "m/s^2", e.accel_bias_mps2, 1.05 * size},
          {"b_a against its direction", "m/s^2", opposite, 0.05 * size},
          {"gravity", "deg", e.gravity_deg, 1.05 * degrees(std::asin(size / kGravity))},
          {"velocity", "m/s", e.velocity_mps, 1.05 * size * 0.5 * window_s}};
}

double windowSeconds(const SyntheticWindow& window) {
  return secondsBetween(window.truth.front().t, window.truth.back().t);
}

ContractCheck followsAccelBias(const Initializer& initializer, const ContractOptions&) {
  const ImuBias plus{Vector3d::Zero(), Vector3d(kAccelBias)};
  const ImuBias minus{Vector3d::Zero(), -plus.accel};
  double best = 0.0, worst_gravity = 0.0;
  BiasTrials trials(initializer, [&](const auto& result, const auto& window) {
    best = std::max(best, result.bias.accel.dot(window.bias.accel) / plus.accel.squaredNorm());
    auto bounds = accelBounds(result, window, windowSeconds(window));
    worst_gravity = std::max(worst_gravity, bounds[2].error);
    return bounds;
  });
  trials.run(plus, BiasPriors());
  trials.run(minus, BiasPriors(), ", opposite bias");
  return trials.verdict(
      format("of a b_a of %.3f m/s^2 at most %.0f %% is found, the rest stays at the prior; "
             "gravity is off by up to %.2f deg",
             plus.accel.norm(), 100.0 * best, worst_gravity),
      best);
}

ContractCheck usesPriorMean(const Initializer& initializer, const ContractOptions&) {
  BiasPriors priors;
  priors.mean = {Vector3d(kGyroBias), Vector3d(kAccelBias)};
  int exact = 0, answered = 0;
  BiasTrials trials(initializer, [&](const auto& result, const auto& window) {
    const WindowErrors e = errorsOf(result.states, result.bias, window);
    ++answered;
    exact += anyExceeded(exactness(e)) ? 0 : 1;
    std::vector<Bounded> bounds = accelBounds(result, window, windowSeconds(window));
    bounds.push_back({"b_g", "rad/s", e.gyro_bias_rps, kShareOfGyroBias * priors.mean.gyro.norm()});
    return bounds;
  });
  trials.run(priors.mean, priors);
  const char* words = exact == answered ? "exact with biases that the priors know"
                                        : "not all exact with biases that the priors know: the "
                                          "method does not use the prior mean of b_a";
  return trials.verdict(format("%d exact; ", exact) + words, exact);
}

}  // namespace

std::vector<CheckEntry> exactnessChecks() {
  std::vector<CheckEntry> checks;
  for (const Motion motion : testing::kAllMotions) {
    const std::string name = toString(motion);
    checks.push_back({{"exact." + name, "Exact on a noise-free window, motion " + name +
                                            ", biases at the priors' mean; or refused."},
                      [motion](const Initializer& initializer, const ContractOptions&) {
                        return exactOn(motion, initializer);
                      }});
  }
  checks.push_back({{"response.gyro_bias", "Finds a known b_g and its opposite, priors at zero."},
                    followsGyroBias});
  checks.push_back({{"response.accel_bias",
                     "A known b_a is estimated, or costs no more than it must, priors at zero."},
                    followsAccelBias});
  checks.push_back(
      {{"response.prior_mean", "Biases that the priors know do no harm."}, usesPriorMean});
  return checks;
}

}  // namespace etalon::contract
