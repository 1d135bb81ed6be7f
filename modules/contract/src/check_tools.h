#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "etalon/contract/contract.h"
#include "etalon/contract/synthetic_window.h"
#include "etalon/core/text.h"
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
ContractCheck refused(const Refusal& refusal);
ContractCheck failed(std::string detail, double value = 0.0);
ContractCheck notApplicable(std::string detail);

/** What came of asking an initializer. */
struct Answer {
  InitializationResult result;
  /** How the plugin broke its word, though the host made a refusal of it; empty if it did not:
   * solve() threw, refused without a reason, or called a success what is none. */
  std::string broken;
};

/** Initializer::initialize(), and whether the plugin kept its word. */
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
/** Largest error over its bound; infinite if one is not a number. */
double worstShare(const std::vector<Bounded>& errors);
/** "RRE 1e-09 deg, ..."; bounds where they are exceeded. */
std::string describe(const std::vector<Bounded>& errors);

/** What a wrong result looks like where it is one of the usual mistakes and clearly so, as the end
 * of a sentence: "; does gravity point up?". Empty otherwise. */
std::string hintAtCause(const Initialization& result, const SyntheticWindow& window);

/** What went wrong in the windows of one check. */
class Complaints {
 public:
  /** @param severity to find the worst one by: an error over its bound, infinity for what is no
   * matter of degree */
  void add(const std::string& where, const std::string& what,
           double severity = std::numeric_limits<double>::infinity());
  bool empty() const { return complaints_.empty(); }
  /** Failed: the worst in the detail with the number of the others, all in the list. */
  ContractCheck verdict() const;

 private:
  struct Complaint {
    std::string text;
    double severity = 0.0;
  };
  std::vector<Complaint> complaints_;
};

}  // namespace etalon::contract
