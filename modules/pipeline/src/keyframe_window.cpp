#include "etalon/pipeline/keyframe_window.h"

#include <algorithm>

#include "etalon/imu/mean_sample.h"

namespace etalon {

namespace {

/** The samples from t0 to t1, as far as there are any, as they are to images that are `offset`
 * later, in the IMU's time, than their stamps. Where only that is beyond the newest sample the mean
 * of as long before stands for what is yet to come. */
std::vector<ImuSample> samplesAtStamps(const ImuBuffer& imu, TimeNs t0, TimeNs t1, TimeNs offset) {
  if (imu.empty()) return {};
  const TimeNs oldest = imu.samples().front().t, newest = imu.samples().back().t;
  const TimeNs end = t1 + offset;
  std::vector<ImuSample> samples =
      imu.between(std::max(t0 + offset, oldest), std::min(end, newest));
  if (offset == 0 || samples.empty()) return samples;
  if (t1 <= newest && newest < end) {
    samples.push_back(meanSample(imu.between(newest - (end - newest), newest)));
    samples.back().t = end;
  }
  for (ImuSample& sample : samples) sample.t -= offset;
  return samples;
}

}  // namespace

KeyframeWindow::KeyframeWindow(int keyframes, double rate_hz)
    : keyframes_(keyframes), rate_hz_(rate_hz), selector_(KeyframeSelectorOptions{rate_hz}) {}

bool KeyframeWindow::isKeyframe(TimeNs t) {
  regular_ = selector_.isKeyframe(t);
  const TimeNs nearest = t + (t - last_frame_) / 2;  // to this frame, up to here
  last_frame_ = t;
  const bool keyframe = regular_ || (additional_due_ && nearest >= *additional_due_);
  if (keyframe) additional_due_.reset();
  return keyframe;
}

void KeyframeWindow::takeSooner(double after_s) {
  if (!stamps_.empty() && regular_) additional_due_ = stamps_.back() + durationNs(after_s);
}

void KeyframeWindow::add(const TrackedFrame& frame, bool keyframe) {
  if (keyframe) stamps_.push_back(frame.t);
  if (keyframe && !regular_) additional_.push_back(frame.t);
  if (stamps_.empty()) return;
  frames_.push_back(frame);
  while (regularKeyframes() > keyframes_) dropFirstKeyframe();
  dropFramesBeforeTheFirstKeyframe();
}

void KeyframeWindow::dropBefore(TimeNs t) {
  while (!stamps_.empty() && stamps_.front() < t) dropFirstKeyframe();
  dropFramesBeforeTheFirstKeyframe();
}

/** With the additional ones behind it: a window begins with a keyframe of the rate. */
void KeyframeWindow::dropFirstKeyframe() {
  stamps_.pop_front();
  while (!additional_.empty() && !stamps_.empty() && additional_.front() == stamps_.front()) {
    stamps_.pop_front();
    additional_.pop_front();
  }
}

void KeyframeWindow::dropFramesBeforeTheFirstKeyframe() {
  while (!frames_.empty() && (stamps_.empty() || frames_.front().t < stamps_.front()))
    frames_.pop_front();
}

void KeyframeWindow::restart() {
  clear();
  selector_ = KeyframeSelector(KeyframeSelectorOptions{rate_hz_});
}

void KeyframeWindow::clear() {
  frames_.clear();
  stamps_.clear();
  additional_.clear();
  additional_due_.reset();
}

InitializationProblem KeyframeWindow::problem(const StereoInertialCalibration& calibration,
                                              const ImuNoiseOptions& noise,
                                              const WindowOptions& options,
                                              const ImuBuffer& imu) const {
  std::vector<TrackedFrame> frames(frames_.begin(), frames_.end());
  std::vector<int> indices;
  for (size_t i = 0; i < frames.size(); ++i)
    if (std::binary_search(stamps_.begin(), stamps_.end(), frames[i].t)) indices.push_back(i);
  ImuBuffer samples(
      samplesAtStamps(imu, stamps_.front(), stamps_.back(), durationNs(options.time_offset_s)));
  const ImuNoiseDensities densities = noise.apply(calibration.imu.noise, samples.samples());
  return makeProblem(calibration, densities, options, std::move(frames), std::move(indices),
                     std::move(samples));
}

}  // namespace etalon
