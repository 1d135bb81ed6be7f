#include "check_tools.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

#include "etalon/core/errors.h"

namespace etalon::contract {

ContractCheck passed(std::string detail, double value) {
  return {"", ContractCheck::Verdict::kPassed, std::move(detail), value};
}

ContractCheck refused(const InitializationResult& result) {
  return {"", ContractCheck::Verdict::kRefused,
          std::string(toString(result.status)) + ": " + result.reason, result.reason_value};
}

ContractCheck failed(std::string detail, double value) {
  return {"", ContractCheck::Verdict::kFailed, std::move(detail), value};
}

ContractCheck notApplicable(std::string detail) {
  return {"", ContractCheck::Verdict::kNotApplicable, std::move(detail), 0.0};
}

std::string format(const char* text, ...) {
  va_list arguments;
  va_start(arguments, text);
  char buffer[512];
  std::vsnprintf(buffer, sizeof(buffer), text, arguments);
  va_end(arguments);
  return buffer;
}

namespace {

/** Is asked when a plugin refused: did the host refuse before asking it? */
class Probe : public Initializer {
  DEFINE_MRPT_OBJECT(Probe, etalon::contract)

 public:
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }
  static constexpr double kReached = 1.25;

 protected:
  InitializationResult solve(const InitializationProblem& /*problem*/) const override {
    return InitializationResult::refusal(InitializationStatus::kNotConverged, "reached", kReached);
  }
};

IMPLEMENTS_MRPT_OBJECT(Probe, etalon::Initializer, etalon::contract)

bool hostAsksThePlugin(const InitializationProblem& problem) {
  const InitializationResult answer = Probe().initialize(problem);
  return answer.reason == "reached" && answer.reason_value == Probe::kReached;
}

/** Shows solve(), to call it without the host's net under it. */
struct WithoutNet : Initializer {
  using Initializer::solve;
};

bool stepOneFailed(const InitializationProblem& problem) {
  if (!problem.visualSolutionComputed()) return false;
  try {
    problem.visualSolution();
  } catch (...) {
    return true;
  }
  return false;
}

/** How the plugin broke its word on a problem that initialize() refused; empty if it did not. */
std::string brokenWord(const Initializer& initializer, const InitializationProblem& problem,
                       const InitializationResult& result) {
  if (!hostAsksThePlugin(problem)) return "";
  try {
    const InitializationResult bare = (initializer.*&WithoutNet::solve)(problem);
    if (bare.ok()) return result.reason;  // "reports success with ..."
    if (bare.reason.empty())
      return std::string("refuses (") + toString(bare.status) + ") without a reason";
  } catch (const std::exception& e) {
    // What step 1 throws may pass through.
    if (dynamic_cast<const Error*>(&e) && stepOneFailed(problem)) return "";
    return std::string("throws: ") + e.what();
  } catch (...) {
    return "throws what is no std::exception";
  }
  return "";
}

}  // namespace

Answer ask(const Initializer& initializer, const InitializationProblem& problem) {
  Answer answer;
  answer.result = initializer.initialize(problem);
  if (!answer.result.ok()) answer.broken = brokenWord(initializer, problem, answer.result);
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

std::string describe(const std::vector<Bounded>& errors) {
  std::string text;
  for (const Bounded& b : errors) {
    text += format("%s%s %.2g %s", text.empty() ? "" : ", ", b.name, b.error, b.unit);
    if (b.exceeded()) text += format(" (at most %.2g is allowed)", b.bound);
  }
  return text;
}

}  // namespace etalon::contract
