#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/flight_errors.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "trial/trial_flight.h"

namespace etalon {
namespace {

/** RMS of the values that are known; NaN without any. */
double rmsOfKnown(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(),
                              [](double value) { return !std::isfinite(value); }),
               values.end());
  return statisticsOf(std::move(values)).rmse;
}

class Judgement {
 public:
  Judgement(const Flown& flown, const GroundTruth& truth, const TrialProtocol& protocol,
            TrialRun* run)
      : flown_(flown), truth_(truth), protocol_(protocol), run_(*run) {}

  void pass() {
    count();
    times();
    run_.causal = errorsOf(flown_.causal);
    run_.smoothed = errorsOf(flown_.smoothed);
    errors_ = flightErrors(flown_.estimates, truth_);
    compareWithPredicted();
    run_.after_start.clear();
    for (const double after_s : timesAfterStart()) run_.after_start.push_back(afterStart(after_s));
    run_.event = firstEvent();
    findFailures();
    run_.status = reasons_.empty() ? kStatusSurvived : kStatusFailed;
    run_.reason = joined(reasons_, "; ");
    if (!reasons_.empty() || std::isfinite(run_.causal.ate_m)) return;
    run_.status = kStatusNotJudged;
    run_.reason = truth_.empty()
                      ? "there is no ground truth"
                      : format("ground truth covers %zu of %zu poses",
                               coveredPoses(flown_.causal, truth_), flown_.causal.size());
  }

 private:
  double secondsAt(TimeNs t) const { return secondsBetween(flown_.images.front(), t); }

  void count() {
    run_.frames = static_cast<int>(flown_.images.size());
    run_.poses = static_cast<int>(flown_.causal.size());
    run_.frame_ms = flown_.frame_ms;
    run_.end_state = flown_.end_state;
    run_.seconds = flown_.images.empty() ? 0.0 : secondsAt(flown_.images.back());
    if (flown_.fault_at) run_.fault_at_s = std::max(0.0, secondsAt(*flown_.fault_at));
    if (flown_.started) run_.started_s = secondsAt(*flown_.started);
  }

  /** How long the pipeline was in the states that nobody wants. */
  void times() {
    if (flown_.estimates.empty()) return;
    run_.dead_reckoning_s = run_.lost_s = 0.0;
    for (size_t i = 1; i < flown_.estimates.size(); ++i) {
      const double step_s = secondsBetween(flown_.estimates[i - 1].t, flown_.estimates[i].t);
      if (flown_.estimates[i].state == PipelineState::kDeadReckoning)
        run_.dead_reckoning_s += step_s;
      if (flown_.estimates[i].state == PipelineState::kLost) run_.lost_s += step_s;
    }
  }

  TrialErrors errorsOf(const Trajectory& trajectory) const {
    TrialErrors errors;
    const AssociatedTrajectories both = associate(trajectory, truth_);
    if (!coversEnough(both.estimate.size(), trajectory.size(), kMinCoverage)) return errors;
    errors.ate_m = absoluteErrors(both, AlignmentType::kSE3).position_m.rmse;
    // Before the start the world is not aligned with gravity, so yaw alone cannot align it.
    const TrajectoryErrors yaw =
        absoluteErrors(both, flown_.started ? AlignmentType::kYawPosition : AlignmentType::kSE3);
    errors.ate_yaw_m = yaw.position_m.rmse;
    errors.rotation_deg = yaw.rotation_deg.rmse;
    const TrajectoryErrors relative = errorsOverASecond(both);
    errors.rpe_m = relative.position_m.rmse;
    errors.rpe_deg = relative.rotation_deg.rmse;
    return errors;
  }

  /** Errors of the motion from a pose to the one that is a second later, to half a frame, and from
   * that one on. Where there is none, the next pose takes the place of the first. */
  TrajectoryErrors errorsOverASecond(const AssociatedTrajectories& both) const {
    const double rate_hz = imageRate(flown_.images);
    if (!(rate_hz >= 1.0)) return {};
    const TimeNs half_frame = durationNs(0.5 / rate_hz);
    const auto& [estimate, reference] = both;
    AssociatedTrajectories motions;
    for (size_t i = 0, j = 0; i < estimate.size();) {
      const TimeNs end = estimate[i].t + kNanosecondsPerSecond;
      while (j < estimate.size() && estimate[j].t < end - half_frame) ++j;
      if (j == estimate.size()) break;
      if (estimate[j].t > end + half_frame) {
        ++i;
        continue;
      }
      motions.estimate.push_back({estimate[j].t, estimate[i].T_WB.inverse() * estimate[j].T_WB});
      motions.reference.push_back(
          {reference[j].t, reference[i].T_WB.inverse() * reference[j].T_WB});
      i = j;
    }
    return absoluteErrors(motions, std::nullopt);
  }

  void compareWithPredicted() {
    std::vector<double> error, sigma;
    for (const FlightErrors& e : errors_) {
      if (!std::isfinite(e.position_m.error) || !std::isfinite(e.position_m.sigma)) continue;
      error.push_back(e.position_m.error);
      sigma.push_back(e.position_m.sigma);
    }
    const double predicted = rmsOfKnown(sigma);
    if (predicted > 0.0) run_.error_over_predicted = rmsOfKnown(error) / predicted;
  }

  ErrorsAfterStart afterStart(double after_s) const {
    ErrorsAfterStart errors;
    errors.after_s = after_s;
    if (!flown_.started || flown_.causal.empty()) return errors;
    // The last frame of the interval may be half a frame early.
    constexpr double kTolerance = 0.03;
    const TimeNs last = flown_.causal.back().t;
    const TimeNs end = after_s > 0.0 ? *flown_.started + durationNs(after_s) : last;
    if (end > last + durationNs(kTolerance)) return errors;
    const auto inside = [&](TimeNs t) {
      return *flown_.started <= t && t <= end + durationNs(kTolerance);
    };
    Trajectory part;
    for (const StampedPose& pose : flown_.causal)
      if (inside(pose.t)) part.push_back(pose);
    const AssociatedTrajectories both = associate(part, truth_);
    if (coversEnough(both.estimate.size(), part.size(), kMinCoverage))
      errors.ate_m = absoluteErrors(both, AlignmentType::kYawPosition).position_m.rmse;
    std::vector<double> velocity, tilt;
    for (size_t i = 0; i < errors_.size(); ++i) {
      if (!inside(flown_.estimates[i].t)) continue;
      velocity.push_back(errors_[i].velocity_mps.error);
      tilt.push_back(errors_[i].tilt_deg.error);
    }
    errors.velocity_mps = rmsOfKnown(velocity);
    errors.tilt_deg = rmsOfKnown(tilt);
    return errors;
  }

  /** Whether the event says that something is wrong: a start is none. */
  static bool isNews(const PipelineEvent& event) {
    return event.remark || event.state == PipelineState::kDeadReckoning ||
           event.state == PipelineState::kLost;
  }

  std::string firstEvent() const {
    for (const PipelineEvent& event : flown_.events)
      if (isNews(event) && (!flown_.fault_at || event.t >= *flown_.fault_at))
        return format("at %.2f s %s: ", secondsAt(event.t), toString(event.state)) + event.reason;
    return "";
  }

  void findFailures() {
    if (!flown_.started) {
      if (flown_.end_state.empty() && !flown_.refusal.empty())  // of a system
        reasons_.push_back(flown_.refusal);
      else
        reasons_.push_back("never started" +
                           (flown_.refusal.empty() ? "" : ", the last attempt: " + flown_.refusal));
      if (flown_.causal.empty()) return;
    }
    findMissingPoses();
    if (run_.causal.ate_m > protocol_.ate_limit_m)
      reasons_.push_back(
          format("ATE %.3f m, more than %g m", run_.causal.ate_m, protocol_.ate_limit_m));
    findSilence();
    if (flown_.end_state == toString(PipelineState::kLost)) {
      std::string why;
      for (const PipelineEvent& event : flown_.events)
        if (event.state == PipelineState::kLost && !event.remark)
          why = format(" since %.2f s: ", secondsAt(event.t)) + event.reason;
      reasons_.push_back("lost" + why);
    }
  }

  void findMissingPoses() {
    if (flown_.causal.empty() || 2 * run_.poses < run_.frames) {
      reasons_.push_back(format("poses for %d of %d frames", run_.poses, run_.frames));
      return;
    }
    const TimeNs since =
        std::max(flown_.causal.front().t, flown_.fault_at.value_or(flown_.causal.front().t));
    // A system's pose may lie a little off the stamp of its frame: counted, not looked up.
    const auto frames = std::count_if(flown_.images.begin(), flown_.images.end(),
                                      [since](TimeNs t) { return t >= since; });
    const auto poses = std::count_if(flown_.causal.begin(), flown_.causal.end(),
                                     [since](const StampedPose& p) { return p.t >= since; });
    if (poses < frames)
      reasons_.push_back(format("no pose for %d of %d frames since %s",
                                static_cast<int>(frames - poses), static_cast<int>(frames),
                                flown_.fault_at ? "the fault" : "the first one"));
  }

  /** Where the position is far off although nothing was said. */
  void findSilence() {
    TimeNs said = flown_.images.back() + 1;
    for (const PipelineEvent& event : flown_.events)
      if (isNews(event) && (!flown_.fault_at || event.t >= *flown_.fault_at))
        said = std::min(said, event.t);
    for (size_t i = 0; i < errors_.size(); ++i) {
      const TimeNs t = flown_.estimates[i].t;
      const ErrorAndSigma& e = errors_[i].position_m;
      if (t >= said) return;
      if ((flown_.fault_at && t < *flown_.fault_at) || !(e.error > kSilentM) ||
          !(e.error > kSilentSigmas * e.sigma))
        continue;
      run_.silent = true;
      reasons_.push_back(format("silent: off by %.2f m at %.2f s, %.0f times the predicted %.3f m",
                                e.error, secondsAt(t), e.error / e.sigma, e.sigma));
      return;
    }
  }

  const Flown& flown_;
  const GroundTruth& truth_;
  const TrialProtocol& protocol_;
  TrialRun& run_;
  std::vector<FlightErrors> errors_;  ///< of flown_.estimates
  std::vector<std::string> reasons_;
};

}  // namespace

void judge(const Flown& flown, const GroundTruth& ground_truth, const TrialProtocol& protocol,
           TrialRun* run) {
  Judgement(flown, ground_truth, protocol, run).pass();
}

void setFaultNotMet(TrialRun* run) {
  if (run->status == kStatusCrashed || run->status == kStatusTimeLimit) return;
  run->status = kStatusFaultNotMet;
  run->reason = "the fault changes no measurement of the run";
  run->silent = false;
}

}  // namespace etalon
