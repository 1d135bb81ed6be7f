#include <algorithm>
#include <cmath>
#include <memory>
#include <thread>

#include "check_tools.h"
#include "etalon/core/so3.h"

namespace etalon::contract {

namespace {

template <typename A, typename B>
bool sameBits(const A& a, const B& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
}

/** First thing in which two estimates differ by a bit; empty if none. Times are left out. */
std::string firstDifference(const Initialization& a, const Initialization& b) {
  if (a.states.size() != b.states.size()) return "the number of states";
  for (size_t k = 0; k < a.states.size(); ++k) {
    const std::string at = " of keyframe " + std::to_string(k);
    if (!sameBits(a.states[k].T_WB.R, b.states[k].T_WB.R)) return "the rotation" + at;
    if (!sameBits(a.states[k].T_WB.t, b.states[k].T_WB.t)) return "the position" + at;
    if (!sameBits(a.states[k].v_WB, b.states[k].v_WB)) return "the velocity" + at;
  }
  if (!sameBits(a.bias.gyro, b.bias.gyro)) return "b_g";
  if (!sameBits(a.bias.accel, b.bias.accel)) return "b_a";
  if (a.landmarks.size() != b.landmarks.size()) return "the number of landmarks";
  const bool same_landmarks =
      std::equal(a.landmarks.begin(), a.landmarks.end(), b.landmarks.begin(),
                 [](const auto& l, const auto& r) {
                   return l.first == r.first && sameBits(l.second, r.second);
                 });
  if (!same_landmarks) return "the landmarks";
  if (!sameBits(a.covariance, b.covariance)) return "the covariance";
  return "";
}

std::string firstDifference(const InitializationResult& a, const InitializationResult& b) {
  if (a.has_value() != b.has_value()) return "the status";
  if (a) return firstDifference(*a, *b);
  if (a.error().status != b.error().status) return "the status";
  return a.error().reason == b.error().reason ? "" : "the reason";
}

/** The same question again: to the same object after another one, to a copy of it, in another
 * thread. */
std::string repeatedDifference(const Initializer& initializer, const Trial& trial,
                               const Trial& other, bool* answered) {
  const InitializationResult first = initializer.initialize(trial.problem());
  *answered = *answered || first.has_value();
  initializer.initialize(other.problem());
  std::string difference = firstDifference(first, initializer.initialize(trial.problem()));
  if (!difference.empty()) return difference + " differs when asked again";
  const std::unique_ptr<mrpt::rtti::CObject> copy(initializer.clone());
  const auto* const twin = dynamic_cast<const Initializer*>(copy.get());
  if (!twin) return "its copy is no initializer, and it";
  difference = firstDifference(first, twin->initialize(trial.problem()));
  if (!difference.empty()) return difference + " differs when a copy is asked";
  // Another thread has another heap: what is ordered by address comes in another order there.
  InitializationResult elsewhere;
  std::thread([&] { elsewhere = initializer.initialize(trial.problem()); }).join();
  difference = firstDifference(first, elsewhere);
  return difference.empty() ? "" : difference + " differs in another thread";
}

ContractCheck isDeterministic(const Initializer& initializer, const ContractOptions&) {
  const Trial other(noisyOptions(Motion::kAggressive, 8));
  int answered = 0;
  for (const Motion motion : testing::kAllMotions) {
    bool has_answered = false;
    // A method that refuses outliers is asked without them.
    for (const double outlier_share : {0.1, 0.0}) {
      SyntheticWindowOptions options = noisyOptions(motion, 7);
      options.outlier_share = outlier_share;
      const std::string difference =
          repeatedDifference(initializer, Trial(options), other, &has_answered);
      if (!difference.empty()) return failed(std::string(toString(motion)) + ": " + difference);
      if (has_answered) break;
    }
    answered += has_answered ? 1 : 0;
  }
  return passed(
      format("six motions with noise, %d answered, the others refused: the same bits", answered),
      answered);
}

/** Largest difference of two results in what does not depend on yaw and origin of the world. */
std::vector<Bounded> differences(const Initialization& a, const Initialization& b, double bound) {
  double rotation = 0, position = 0, velocity = 0;
  const SE3 T_B0W_a = a.states.front().T_WB.inverse(), T_B0W_b = b.states.front().T_WB.inverse();
  for (size_t k = 0; k < a.states.size(); ++k) {
    const StampedState &x = a.states[k], &y = b.states[k];
    const SE3 T_a = T_B0W_a * x.T_WB, T_b = T_B0W_b * y.T_WB;
    rotation = std::max(rotation, logSO3(T_a.R.transpose() * T_b.R).norm());
    position = std::max(position, (T_a.t - T_b.t).norm());
    velocity =
        std::max(velocity, (x.T_WB.R.transpose() * x.v_WB - y.T_WB.R.transpose() * y.v_WB).norm());
  }
  const double gravity = angleBetween(a.states.front().T_WB.R.row(2).transpose(),
                                      b.states.front().T_WB.R.row(2).transpose());
  return {{"rotation", "rad", rotation, bound},
          {"position", "m", position, bound},
          {"gravity", "rad", gravity, bound},
          {"velocity", "m/s", velocity, bound},
          {"b_g", "rad/s", (a.bias.gyro - b.bias.gyro).norm(), bound},
          {"b_a", "m/s^2", (a.bias.accel - b.bias.accel).norm(), bound}};
}

/** "success", or status and reason of the refusal. */
std::string statusOf(const InitializationResult& result) {
  return result ? "success" : refused(result.error()).detail;
}

using OptionsChange = std::function<void(SyntheticWindowOptions*)>;

/** Each motion twice, as `prepare` leaves the options and as `change` does then: results within
 * `bound`. */
ContractCheck compareChanged(const Initializer& initializer, double bound,
                             const OptionsChange& prepare, const OptionsChange& change) {
  Refusal last_refusal;
  double largest = 0.0;
  int answered = 0;
  for (const Motion motion : testing::kAllMotions) {
    const std::string where = std::string(toString(motion)) + ": ";
    SyntheticWindowOptions options = noisyOptions(motion, 5);
    prepare(&options);
    const Answer before = ask(initializer, Trial(options).problem());
    change(&options);
    const Answer after = ask(initializer, Trial(options).problem());
    for (const Answer& answer : {before, after})
      if (!answer.broken.empty()) return failed(where + answer.broken);
    if (before.result.has_value() != after.result.has_value() ||
        (!before.result && before.result.error().status != after.result.error().status))
      return failed(where + "once " + statusOf(before.result) + ", once " + statusOf(after.result));
    if (!before.result) {
      last_refusal = before.result.error();
      continue;
    }
    ++answered;
    const auto errors = differences(*before.result, *after.result, bound);
    if (anyExceeded(errors)) return failed(where + describe(errors));
    for (const Bounded& e : errors) largest = std::max(largest, e.error);
  }
  if (answered == 0) return refused(last_refusal);
  return passed(format("%d motions: at most %.2g apart (rad, m, m/s, rad/s, m/s^2; bound %.0g)",
                       answered, largest, bound),
                largest);
}

ContractCheck ignoresWorld(const Initializer& initializer, const ContractOptions&) {
  // The measurements are the same to rounding (1e-13 of some hundred pixels); what a solver makes
  // of that stays below its own tolerance, 1e-6 of the estimates.
  return compareChanged(
      initializer, 1e-5, [](SyntheticWindowOptions*) {},
      [](SyntheticWindowOptions* options) {
        options->world_yaw_rad = 2.1;
        options->world_origin = {30.0, -70.0, 5.0};
      });
}

ContractCheck ignoresTimeOrigin(const Initializer& initializer, const ContractOptions&) {
  // Differences of stamps are whole nanoseconds: nothing changes, unless an absolute time was held
  // in a double, which at 1.4e9 s errs by 1e-7 s: 1e-6 m/s and more.
  // Not of keyframes a quarter of a second apart, though: that is a whole multiple of what such a
  // double resolves, and the difference of two is exact.
  return compareChanged(
      initializer, 1e-9,
      [](SyntheticWindowOptions* options) { options->keyframe_rate_hz = 1.0 / 0.2500371; },
      [](SyntheticWindowOptions* options) { options->start = 1'000'000'000; });
}

}  // namespace

std::vector<CheckEntry> samenessChecks() {
  return {
      {{"deterministic", "The same problem gives the same result, bit for bit."}, isDeterministic},
      {{"invariant.world", "Yaw and origin of the world do not matter."}, ignoresWorld},
      {{"invariant.time_origin", "The origin of time does not matter."}, ignoresTimeOrigin}};
}

}  // namespace etalon::contract
