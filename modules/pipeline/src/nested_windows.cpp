#include "etalon/pipeline/nested_windows.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "etalon/core/statistics.h"
#include "etalon/initialization/estimation_error.h"

namespace etalon {
namespace {

tl::unexpected<Refusal> nothingToCompare() {
  return refuse(
      RefusalStatus::kTooFewKeyframes,
      "no window before this one confirms its estimate; the next keyframe brings one that "
      "can be compared");
}

/** What has not is no estimate, and its covariance says nothing of it. */
bool hasConverged(const InitializationAttempt& attempt) {
  return !attempt.has_vi_ba || attempt.vi_ba.summary.converged();
}

}  // namespace

Expected<void> agree(const InitializationAttempt& earlier, const InitializationAttempt& later,
                     const AcceptanceOptions& options) {
  const Eigen::MatrixXd covariance = earlier.covariance();
  if (covariance.size() == 0 || !hasConverged(earlier)) return nothingToCompare();
  std::vector<StampedState> before, after;
  for (const StampedState& state : earlier.states())
    for (const StampedState& same : later.states())
      if (same.t == state.t) {
        before.push_back(state);
        after.push_back(same);
      }
  if (before.size() < 2) return nothingToCompare();
  WindowTruth truth;  // of which the earlier estimate differs
  truth.R_WB0 = after.front().T_WB.R;
  truth.v_WB = after.back().v_WB;
  truth.bias = later.bias();
  const Eigen::Matrix<double, 11, 1> difference = estimationError(before, earlier.bias(), truth);
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return nothingToCompare();
  const double chi2 = difference.dot(factor.solve(difference));
  const double bound = options.noise_margin * options.noise_margin *
                       chiSquareQuantile(difference.size(), options.false_alarm_rate);
  if (!(chi2 <= bound))
    return refuse(RefusalStatus::kImplausible,
                  "the estimate differs from that of the window before with chi2 ", Value(chi2, 1),
                  " (11 degrees of freedom), at most ", Bound(bound, 1), " is plausible");
  return {};
}

bool confirm(const InitializationAttempt* earlier, const AcceptanceOptions& options,
             InitializationAttempt* attempt) {
  if (!attempt->accepted() || !(options.false_alarm_rate > 0.0)) return true;
  Expected<void> verdict = nothingToCompare();
  if (earlier) verdict = agree(*earlier, *attempt, options);
  if (verdict) return true;
  attempt->decision = refuse(verdict.error());
  return verdict.error().status != RefusalStatus::kTooFewKeyframes;
}

}  // namespace etalon
