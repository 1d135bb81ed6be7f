#include "etalon/pipeline/front_stage.h"

#include "etalon/core/stopwatch.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

FrontStage::FrontStage(const StereoInertialCalibration& calibration,
                       const StereoTrackerOptions& options, const ImuNoiseDensities& noise,
                       double max_gap_s, double keep_imu_s)
    : noise_(noise),
      max_gap_s_(max_gap_s),
      keep_imu_s_(keep_imu_s),
      tracker_(calibration, options) {}

void FrontStage::add(const ImuSample& sample) {
  imu_.add(sample);
  const TimeNs needed = sample.t - durationNs(keep_imu_s_);
  if (!tracked_at_ || *tracked_at_ < needed) imu_.dropBefore(needed);
}

FrontFrame FrontStage::process(const StereoFrame& frame, const ImuBias& bias) {
  Stopwatch watch;
  FrontFrame result;
  result.t = frame.t;
  result.images = frame;
  const TimeNs before = last_frame_.value_or(frame.t), tracked_at = tracked_at_.value_or(frame.t);
  last_frame_ = frame.t;
  const std::vector<ImuSample> since_last = imu_.between(before, frame.t);
  const bool last_was_tracked = before == tracked_at;
  if (tracked_at < frame.t && imu_.covers(tracked_at, frame.t))
    result.R_prev_cur =
        Preintegration(last_was_tracked ? since_last : imu_.between(tracked_at, frame.t), bias,
                       noise_)
            .deltas()
            .dR;
  if (!repeated_images_.isRepeated(frame.left, frame.right, since_last)) {
    result.after_gap = secondsBetween(tracked_at, frame.t) > max_gap_s_;
    tracked_at_ = frame.t;
    result.tracked = tracker_.track(frame.t, frame.left, frame.right, result.R_prev_cur);
    repeated_images_.tracked(*result.tracked);
    imu_.dropBefore(frame.t);
  }
  result.ms = watch.lapMilliseconds();
  return result;
}

}  // namespace etalon
