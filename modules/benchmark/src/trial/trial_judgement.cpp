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
class RootMeanSquare {
 public:
  void add(double value) {
    if (!std::isfinite(value)) return;
    sum_ += value * value;
    ++count_;
  }
  double value() const { return count_ == 0 ? WindowErrors::kNone : std::sqrt(sum_ / count_); }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

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
    const int second = static_cast<int>(std::lround(imageRate(flown_.images)));
    if (second < 1) return errors;
    const TrajectoryErrors relative =
        relativeErrors(both, {static_cast<double>(second), DeltaUnit::kFrames});
    errors.rpe_m = relative.position_m.rmse;
    errors.rpe_deg = relative.rotation_deg.rmse;
    return errors;
  }

  void compareWithPredicted() {
    RootMeanSquare error, sigma;
    for (const FlightErrors& e : errors_) {
      if (!std::isfinite(e.position_m.error) || !std::isfinite(e.position_m.sigma)) continue;
      error.add(e.position_m.error);
      sigma.add(e.position_m.sigma);
    }
    if (sigma.value() > 0.0) run_.error_over_predicted = error.value() / sigma.value();
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
    RootMeanSquare velocity, tilt;
    for (size_t i = 0; i < errors_.size(); ++i) {
      if (!inside(flown_.estimates[i].t)) continue;
      velocity.add(errors_[i].velocity_mps.error);
      tilt.add(errors_[i].tilt_deg.error);
    }
    errors.velocity_mps = velocity.value();
    errors.tilt_deg = tilt.value();
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
      const PredictedError& e = errors_[i].position_m;
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
