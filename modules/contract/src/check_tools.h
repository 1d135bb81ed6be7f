#pragma once

#include <functional>
#include <string>
#include <vector>

#include "etalon/contract/contract.h"
#include "etalon/contract/synthetic_window.h"
#include "etalon/initialization/initializer.h"

namespace etalon::contract {

using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

/** One check as the suite runs it; the name is filled in by the suite. */
struct CheckEntry {
  ContractCheckDescription description;
  std::function<ContractCheck(const Initializer&, const ContractOptions&)> run;
};

// The checks by theme, one source file each.
std::vector<CheckEntry> exactnessChecks();
std::vector<CheckEntry> samenessChecks();
std::vector<CheckEntry> robustnessChecks();
std::vector<CheckEntry> covarianceChecks();
std::vector<CheckEntry> interfaceChecks();

ContractCheck passed(std::string detail, double value = 0.0);
ContractCheck refused(const InitializationResult& result);
ContractCheck failed(std::string detail, double value = 0.0);
ContractCheck notApplicable(std::string detail);

/** printf into a string. */
__attribute__((format(printf, 1, 2))) std::string format(const char* text, ...);

/** What came of asking an initializer. */
struct Answer {
  InitializationResult result;
  /** How the plugin broke its word, though the host made a refusal of it; empty if it did not:
   * solve() threw (other than what step 1 threw), refused without a reason, or called a success
   * what is none. */
  std::string broken;
};

/** Initializer::initialize(); where that refuses, also whether it had to cover up for the plugin.
 */
Answer ask(const Initializer& initializer, const InitializationProblem& problem);

/** A window with its problem. */
struct Trial {
  explicit Trial(const SyntheticWindowOptions& options);
  SyntheticWindowOptions options;
  SyntheticWindow window;
  /** Anew from `window` at each call, nothing computed yet. */
  InitializationProblem problem() const;
};

/** Noise of half a pixel and of the IMU's data sheet, known to the problem. */
SyntheticWindowOptions noisyOptions(Motion motion, unsigned seed);

/** An error against its bound. */
struct Bounded {
  const char* name;
  const char* unit;
  double error, bound;
  bool exceeded() const { return !(error <= bound); }
};
bool anyExceeded(const std::vector<Bounded>& errors);
/** "RRE 1e-09 deg, ..."; bounds where they are exceeded. */
std::string describe(const std::vector<Bounded>& errors);

}  // namespace etalon::contract
