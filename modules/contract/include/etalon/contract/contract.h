#pragma once

#include <functional>
#include <string>
#include <vector>

#include "etalon/core/process/isolated_run.h"
#include "etalon/initialization/initializer.h"
#include "etalon/simulation/synthetic_window.h"

namespace etalon {

/** What one check of the contract found. */
struct ContractCheck {
  enum class Verdict {
    kPassed,
    kRefused,        ///< the initializer refused with a reason, which is allowed here
    kFailed,         ///< the contract is broken
    kNotApplicable,  ///< the check asks for what the method does not claim, e.g. a covariance
  };

  std::string name;
  Verdict verdict = Verdict::kFailed;
  std::string detail;  ///< one sentence: what was found, against which bound
  double value = 0.0;  ///< the number behind it, unit as in the detail
  /** Where several windows failed: what each did, the worst first; `detail` has that one. */
  std::vector<std::string> failures = {};
  /** Where a Monte Carlo is over several motions: the detail of each by itself. */
  std::vector<std::string> by_motion = {};
};

/** Lower-case word as it stands in reports: "passed", "refused", "failed", "not_applicable". */
const char* toString(ContractCheck::Verdict verdict);

struct ContractOptions {
  /** Names of the checks to run; empty: all. A name ending in '.' stands for all that begin so. */
  std::vector<std::string> only;
  bool isolated = true;  ///< each check in a process of its own
  IsolationLimits limits;
  /**
   * How far the average NEES may be from consistent, as a whole and of each block (b_g, b_a,
   * gravity, velocity): between 1/f and f times its expectation, each widened by the 99 % band of
   * the chi-square distribution. 1.3 is 14 % in the standard deviations: a covariance is of first
   * order. A plugin that needs more says so in its README.
   */
  double allowed_nees_factor = 1.3;
  int monte_carlo_windows = 60;
  /** Motions of the Monte Carlo, in turn; empty: gentle and aggressive, or the first one in which
   * the method gives a covariance. */
  std::vector<testing::Motion> monte_carlo_motions;
  int timed_calls = 9;
};

struct ContractReport {
  std::vector<ContractCheck> checks;
  double milliseconds_per_call = 0.0;  ///< median of the plugin's own work; 0 if not measured
  /** Why the suite stopped before its end, with the checks that hung; empty if it did not. */
  std::string stopped;

  int count(ContractCheck::Verdict verdict) const;
  /** Whether no check failed. */
  bool ok() const { return count(ContractCheck::Verdict::kFailed) == 0; }
};

/** Name and one line of every check, in the order in which they run. */
struct ContractCheckDescription {
  std::string name, description;
};
std::vector<ContractCheckDescription> contractChecks();

/**
 * What every initializer promises, tried on synthetic windows with exact truth
 * (docs/writing-a-plugin.md says what and why). Knows no plugin by name. Deterministic but for the
 * time per call. After two checks that ran out of time the rest is not run.
 *
 * @param on_check called after each check, for those who want to show progress; may be empty
 * @throws ConfigError if `only` names a check that does not exist
 */
ContractReport checkContract(const Initializer& initializer, const ContractOptions& options = {},
                             const std::function<void(const ContractCheck&)>& on_check = {});

}  // namespace etalon
