#include "etalon/pipeline/keyframe_window.h"

#include <algorithm>

namespace etalon {

KeyframeWindow::KeyframeWindow(int keyframes, double rate_hz)
    : keyframes_(keyframes), rate_hz_(rate_hz), selector_(KeyframeSelectorOptions{rate_hz}) {}

void KeyframeWindow::add(const TrackedFrame& frame, bool keyframe) {
  if (keyframe) stamps_.push_back(frame.t);
  if (stamps_.empty()) return;
  frames_.push_back(frame);
  while (static_cast<int>(stamps_.size()) > keyframes_) stamps_.pop_front();
  while (frames_.front().t < stamps_.front()) frames_.pop_front();
}

void KeyframeWindow::restart() {
  clear();
  selector_ = KeyframeSelector(KeyframeSelectorOptions{rate_hz_});
}

void KeyframeWindow::clear() {
  frames_.clear();
  stamps_.clear();
}

InitializationProblem KeyframeWindow::problem(const StereoInertialCalibration& calibration,
                                              const ImuNoiseOptions& noise,
                                              const WindowOptions& options,
                                              const ImuBuffer& imu) const {
  std::vector<TrackedFrame> frames(frames_.begin(), frames_.end());
  std::vector<int> indices;
  for (size_t i = 0; i < frames.size(); ++i)
    if (std::binary_search(stamps_.begin(), stamps_.end(), frames[i].t)) indices.push_back(i);
  ImuBuffer samples(imu.between(stamps_.front(), stamps_.back()));
  const ImuNoiseDensities densities = noise.apply(calibration.imu.noise, samples.samples());
  return makeProblem(calibration, densities, options, std::move(frames), std::move(indices),
                     std::move(samples));
}

}  // namespace etalon
