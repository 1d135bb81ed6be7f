#include <algorithm>
#include <memory>

#include "check_tools.h"
#include "etalon/core/statistics.h"
#include "etalon/core/stopwatch.h"

namespace etalon::contract {

namespace {

ContractCheck declaresParameters(const Initializer& initializer, const ContractOptions&) {
  const std::unique_ptr<mrpt::rtti::CObject> copies[] = {
      std::unique_ptr<mrpt::rtti::CObject>(initializer.clone()),
      std::unique_ptr<mrpt::rtti::CObject>(initializer.clone())};
  auto* const one = dynamic_cast<Initializer*>(copies[0].get());
  auto* const two = dynamic_cast<Initializer*>(copies[1].get());
  if (!one || !two) return failed("its copy is no initializer");
  ParameterSet a("plugin"), b("plugin");
  one->declareParameters(a);
  two->declareParameters(b);
  for (const auto& d : a.describe())
    if (d.doc.empty()) return failed("parameter '" + d.key + "' has no documentation");
  if (a.toIni() != b.toIni()) return failed("two objects declare different parameters");
  a.read(IniFile::fromText(a.toIni(), "its own section"));
  if (a.toIni() != b.toIni()) return failed("its own INI section does not read back the same");
  return passed(format("%zu parameters, documented; its INI section reads back the same",
                       a.describe().size()),
                static_cast<double>(a.describe().size()));
}

ContractCheck declaresNeeds(const Initializer& initializer, const ContractOptions&) {
  bool used = false;
  for (const Motion motion : testing::kAllMotions) {
    SyntheticWindowOptions options;
    options.motion = motion;
    const InitializationProblem problem = Trial(options).problem();
    initializer.initialize(problem);
    used = used || problem.visualSolutionComputed();
  }
  if (used && !initializer.needsVisualSolution())
    return failed("uses stereo odometry, but needsVisualSolution() says that it does not");
  if (!used && initializer.needsVisualSolution())
    return failed("needsVisualSolution() says that it uses stereo odometry, but it does not");
  return passed(used ? "uses stereo odometry and says so" : "uses tracks and IMU only and says so");
}

ContractCheck measureTime(const Initializer& initializer, const ContractOptions& options) {
  Refusal last_refusal;
  for (const Motion motion : testing::kAllMotions) {
    const InitializationProblem problem = Trial(noisyOptions(motion, 1)).problem();
    const Answer answer = ask(initializer, problem);  // stereo odometry is computed here, once
    if (!answer.broken.empty()) return failed(std::string(toString(motion)) + ": " + answer.broken);
    if (!answer.result) {
      last_refusal = answer.result.error();
      continue;
    }
    std::vector<double> milliseconds;
    for (int i = 0; i < std::max(1, options.timed_calls); ++i) {
      Stopwatch watch;
      initializer.initialize(problem);
      milliseconds.push_back(watch.lapMilliseconds());
    }
    const double typical = median(milliseconds);
    std::string text = format("%.3g ms a call (median of %zu, %s)", typical, milliseconds.size(),
                              toString(motion));
    if (problem.visualSolutionComputed())
      text += format(", besides %.3g ms of stereo odometry", problem.visualSolutionMilliseconds());
    return passed(text, typical);
  }
  return refused(last_refusal);
}

}  // namespace

std::vector<CheckEntry> interfaceChecks() {
  return {{{"parameters", "Every parameter is documented; the INI section reads back the same."},
           declaresParameters},
          {{"needs", "needsVisualSolution() tells the truth."}, declaresNeeds},
          {{"time", "Milliseconds per call; how many is judged by nobody."}, measureTime}};
}

}  // namespace etalon::contract
