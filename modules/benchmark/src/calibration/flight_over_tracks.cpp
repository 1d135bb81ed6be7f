#include "etalon/benchmark/calibration/flight_over_tracks.h"

#include "etalon/benchmark/windows.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/pipeline/lost_pose.h"
#include "etalon/pipeline/odometry_start.h"

namespace etalon {
namespace {

FrameEstimate estimateOf(const OdometryOutput& output, const PipelineOptions& options) {
  FrameEstimate estimate;
  estimate.t = output.t;
  const bool lost = !whyLost(output, options.max_dead_reckoning_s, false).empty();
  estimate.state = output.unlocated_s == 0.0 ? PipelineState::kInertial
                   : lost                    ? PipelineState::kLost
                                             : PipelineState::kDeadReckoning;
  estimate.nav = output.state;
  estimate.pose_covariance = output.covariance.topLeftCorner<6, 6>();
  estimate.motion_variance = output.covariance.diagonal().tail<9>();
  return estimate;
}

}  // namespace

std::optional<TracksStart> firstStart(const SequenceTracks& tracks, const PipelineOptions& options,
                                      const Initializer& initializer) {
  const WindowShape shape{options.keyframes, options.keyframe_rate_hz};
  constexpr double kEveryS = 0.25;
  if (tracks.frames.empty()) return std::nullopt;
  const int windows = windowCount(tracks.first_image, tracks.frames.back().t, kEveryS, shape);
  for (int window = 0; window < windows; ++window) {
    const InitializationProblem problem =
        windowProblem(tracks, kEveryS, shape, window, options.imu_noise, options.window);
    const InitializationAttempt attempt =
        attemptInitialization(problem, initializer, options.window);
    if (!attempt.accepted()) continue;
    TracksStart first;
    while (tracks.frames[first.frame].t != attempt.keyframes.front()) ++first.frame;
    first.accepted = attempt.t;
    first.start = odometryStart(attempt, SE3(), options.window.priors);
    return first;
  }
  return std::nullopt;
}

std::vector<FrameEstimate> flyOverTracks(const SequenceTracks& tracks,
                                         const PipelineOptions& options,
                                         const Initializer& initializer) {
  std::vector<FrameEstimate> estimates;
  const std::optional<TracksStart> first = firstStart(tracks, options, initializer);
  if (!first) return estimates;
  FixedLagOdometry odometry(tracks.calibration, options.fixedLag(tracks.calibration.imu.noise));
  for (size_t i = first->frame; i < tracks.frames.size(); ++i) {
    const TrackedFrame& frame = tracks.frames[i];
    const OdometryOutput output =
        i == first->frame
            ? odometry.start(first->start, frame)
            : odometry.process(frame, tracks.imu.between(tracks.frames[i - 1].t, frame.t));
    if (frame.t < first->accepted) continue;
    estimates.push_back(estimateOf(output, options));
    if (estimates.back().state == PipelineState::kLost) break;
  }
  return estimates;
}

}  // namespace etalon
