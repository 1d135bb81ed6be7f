#include "etalon/frontend/front_stage.h"

#include "etalon/core/stopwatch.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

FrontStage::FrontStage(const StereoInertialCalibration& calibration,
                       const StereoTrackerOptions& options)
    : tracker_(calibration, options) {}

FrontFrame FrontStage::process(const StereoFrame& frame, const ImuBuffer& imu, const ImuBias& bias,
                               bool in_flight) {
  Stopwatch watch;
  FrontFrame result;
  result.t = frame.t;
  result.images = frame;
  const TimeNs before = last_frame_.value_or(frame.t), tracked_at = tracked_at_.value_or(frame.t);
  last_frame_ = frame.t;
  const std::vector<ImuSample> since_last = imu.between(before, frame.t);
  const bool last_was_tracked = before == tracked_at;
  Eigen::Matrix3d R_prev_cur = Eigen::Matrix3d::Identity();  // of the body since tracked_at
  if (tracked_at < frame.t && imu.covers(tracked_at, frame.t))
    R_prev_cur =  // whatever the noise
        Preintegration(last_was_tracked ? since_last : imu.between(tracked_at, frame.t), bias,
                       ImuNoiseDensities())
            .deltas()
            .dR;
  result.repeated = repeated_images_.areRepeated(frame.left, frame.right, since_last);
  if (!result.repeated[0] || !result.repeated[1]) {
    cv::Mat* const images[] = {&result.images.left, &result.images.right};
    for (size_t c = 0; c < 2; ++c)
      if (result.repeated[c]) *images[c] = cv::Mat::zeros(images[c]->size(), images[c]->type());
    tracked_at_ = frame.t;
    result.tracked =
        tracker_.track(frame.t, result.images.left, result.images.right, R_prev_cur, in_flight);
    repeated_images_.tracked(*result.tracked);
  }
  result.ms = watch.lapMilliseconds();
  return result;
}

}  // namespace etalon
