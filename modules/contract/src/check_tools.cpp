#include "check_tools.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace etalon::contract {

ContractCheck passed(std::string detail, double value) {
  return {"", ContractCheck::Verdict::kPassed, std::move(detail), value};
}

ContractCheck refused(const Refusal& refusal) {
  return {"", ContractCheck::Verdict::kRefused,
          std::string(toString(refusal.status)) + ": " + refusal.reason,
          refusal.value.value_or(0.0)};
}

ContractCheck failed(std::string detail, double value) {
  return {"", ContractCheck::Verdict::kFailed, std::move(detail), value};
}

ContractCheck notApplicable(std::string detail) {
  return {"", ContractCheck::Verdict::kNotApplicable, std::move(detail), 0.0};
}

namespace {

/** Stands in for a plugin that refused, to see whether the host had refused before it was asked. */
class Probe : public Initializer {
  DEFINE_MRPT_OBJECT(Probe, etalon::contract)

 public:
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }
  static constexpr char kReached[] = "reached";

 protected:
  InitializationResult solve(const InitializationProblem& /*problem*/) const override {
    return refuse(RefusalStatus::kNotConverged, kReached);
  }
};

IMPLEMENTS_MRPT_OBJECT(Probe, etalon::Initializer, etalon::contract)

bool hostAsksThePlugin(const InitializationProblem& problem) {
  return Probe().initialize(problem).error().reason == Probe::kReached;
}

/** Makes solve() accessible, to call it without the checks of initialize(). */
struct WithoutNet : Initializer {
  using Initializer::solve;
};

/** How the plugin broke its word on a problem that initialize() refused; empty if it did not. */
std::string brokenWord(const Initializer& initializer, const InitializationProblem& problem,
                       const Refusal& refusal) {
  if (!hostAsksThePlugin(problem)) return "";
  try {
    const InitializationResult bare = (initializer.*&WithoutNet::solve)(problem);
    if (bare) return refusal.reason;  // "reports success with ..."
    if (bare.error().reason.empty())
      return std::string("refuses (") + toString(bare.error().status) + ") without a reason";
  } catch (const std::exception& e) {
    return std::string("throws: ") + e.what();
  } catch (...) {
    return "throws what is no std::exception";
  }
  return "";
}

}  // namespace

Answer ask(const Initializer& initializer, const InitializationProblem& problem) {
  Answer answer{initializer.initialize(problem), ""};
  if (!answer.result) answer.broken = brokenWord(initializer, problem, answer.result.error());
  return answer;
}

Trial::Trial(const SyntheticWindowOptions& o)
    : options(o), window(testing::makeSyntheticWindow(o)) {}

InitializationProblem Trial::problem() const { return testing::makeProblem(window, options); }

SyntheticWindowOptions noisyOptions(Motion motion, unsigned seed) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.seed = seed;
  options.sigma_px = options.assumed_sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.start = 1'403'636'579'763'555'584;  // nothing that a double in seconds could hold
  return options;
}

bool anyExceeded(const std::vector<Bounded>& errors) {
  return std::any_of(errors.begin(), errors.end(), [](const Bounded& b) { return b.exceeded(); });
}

double worstShare(const std::vector<Bounded>& errors) {
  double worst = 0.0;
  for (const Bounded& b : errors) {
    const double share = b.error / b.bound;
    if (!(share <= std::numeric_limits<double>::max()))
      return std::numeric_limits<double>::infinity();
    worst = std::max(worst, share);
  }
  return worst;
}

std::string describe(const std::vector<Bounded>& errors) {
  std::string text;
  for (const Bounded& b : errors) {
    text += format("%s%s %.2g %s", text.empty() ? "" : ", ", b.name, b.error, b.unit);
    if (b.exceeded()) text += format(" (at most %.2g is allowed)", b.bound);
  }
  return text;
}

namespace {

/** Whether a mistake explains an estimate: the error is of the size of the truth, and undoing the
 * mistake leaves a twentieth of it. */
bool explains(double error, double error_undone, double size) {
  return error > 0.2 * size && error_undone < 0.05 * error;
}

/** RMS over the keyframes of v_WB less its truth in the body frame, m/s, with the velocities turned
 * by `turn` first. */
double velocityError(const Initialization& result, const SyntheticWindow& window,
                     const std::function<Eigen::Matrix3d(const StampedState&)>& turn) {
  std::vector<StampedState> states = result.states;
  for (StampedState& s : states) s.v_WB = turn(s) * s.v_WB;
  return testing::errorsOf(states, result.bias, window).velocity_mps;
}

double typicalSpeed(const SyntheticWindow& window) {
  double sum = 0.0;
  for (const StampedState& s : window.truth) sum += s.v_WB.squaredNorm();
  return std::sqrt(sum / static_cast<double>(window.truth.size()));
}

}  // namespace

std::string hintAtCause(const Initialization& result, const SyntheticWindow& window) {
  const WindowErrors errors = testing::errorsOf(result.states, result.bias, window);
  std::string text;
  if (errors.gravity_deg > 175.0) text += "; does gravity point up?";
  constexpr double kSlowest = 0.05, kSmallestGyroBias = 1e-3, kSmallestAccelBias = 1e-2;
  if (const double speed = typicalSpeed(window); speed > kSlowest) {
    const Eigen::Matrix3d R_WB0 = result.states.front().T_WB.R;
    const double from_body =
        velocityError(result, window, [](const StampedState& s) { return s.T_WB.R; });
    const double from_first = velocityError(
        result, window, [&R_WB0](const StampedState&) -> const Eigen::Matrix3d& { return R_WB0; });
    if (explains(errors.velocity_mps, from_body, speed))
      text += "; velocity expressed in the body frame?";
    else if (explains(errors.velocity_mps, from_first, speed))
      text += "; velocity expressed in the frame of the first keyframe?";
  }
  if (const double size = window.bias.gyro.norm();
      size > kSmallestGyroBias &&
      explains(errors.gyro_bias_rps, (result.bias.gyro + window.bias.gyro).norm(), size))
    text += "; the sign of b_g?";
  if (const double size = window.bias.accel.norm();
      size > kSmallestAccelBias &&
      explains(errors.accel_bias_mps2, (result.bias.accel + window.bias.accel).norm(), size))
    text += "; the sign of b_a?";
  return text;
}

void Complaints::add(const std::string& where, const std::string& what, double severity) {
  complaints_.push_back({where + ": " + what, severity});
}

ContractCheck Complaints::verdict() const {
  std::vector<Complaint> sorted = complaints_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Complaint& a, const Complaint& b) { return a.severity > b.severity; });
  std::string detail = sorted.front().text;
  if (sorted.size() > 1)
    detail += format("; %zu more window%s failed", sorted.size() - 1, sorted.size() > 2 ? "s" : "");
  ContractCheck check = failed(detail);
  for (const Complaint& complaint : sorted) check.failures.push_back(complaint.text);
  return check;
}

}  // namespace etalon::contract
