// Pipeline: from whoever delivers measurements to the estimator, on one thread or three.

#include <algorithm>
#include <cstdio>
#include <utility>

#include "etalon/pipeline/pipeline.h"

namespace etalon {

void Pipeline::process(const mrpt::obs::CObservation& observation) {
  throwFailure();
  const std::lock_guard<std::mutex> lock(border_mutex_);
  if (finished_) return;
  auto measurement = observation_input_.convert(observation);
  if (const auto* unusable = std::get_if<UnusableObservation>(&measurement)) {
    if (unusable->kind == UnusableObservation::Kind::kBroken)
      border_.count(InputFault::kObservationBroken, unusable->t);
    else if (unusable->kind == UnusableObservation::Kind::kUnpaired)
      border_.count(InputFault::kImageUnpaired, unusable->t);
    return;
  }
  SensorEvent& event = std::get<SensorEvent>(measurement);
  if (const auto* sample = std::get_if<ImuSample>(&event))
    border_.add(*sample);
  else
    admit(std::move(std::get<StereoFrame>(event)));
  processAdmitted();
}

void Pipeline::add(const ImuSample& sample) {
  throwFailure();
  const std::lock_guard<std::mutex> lock(border_mutex_);
  if (finished_) return;
  border_.add(sample);
  processAdmitted();
}

void Pipeline::add(StereoFrame frame) {
  throwFailure();
  const std::lock_guard<std::mutex> lock(border_mutex_);
  if (finished_) return;
  admit(std::move(frame));
  processAdmitted();
}

/** From here on the pixels are the pipeline's own: a frame may wait for the IMU, and the window and
 * the map keep images, while the caller uses its buffers again. */
void Pipeline::admit(StereoFrame frame) {
  for (cv::Mat* image : {&frame.left, &frame.right}) {
    const bool held_by_others = !image->u || image->u->refcount > 1;
    if (held_by_others) *image = image->clone();
  }
  border_.add(std::move(frame));
}

void Pipeline::finish() {
  // Held to the end: who calls at the same time finds the run finished.
  const std::lock_guard<std::mutex> lock(border_mutex_);
  const bool again = std::exchange(finished_, true);
  if (!again) {
    border_.finish();
    processAdmitted();
    joinThreads();
  }
  throwFailure();
  if (again || !last_frame_) return;
  // Where the IMU goes on a little longer the last image is just the end of the recording.
  if (!imu_.empty() &&
      secondsBetween(*last_frame_, imu_.samples().back().t) > options_.input.max_gap_s)
    noticeMissingImages(imu_.samples().back().t);
  remark(*last_frame_, missing_.finish());
}

/** From the last frame to `until`: there, the IMU alone carried the pose. */
void Pipeline::noticeMissingImages(TimeNs until) {
  if (!last_frame_ || clock_step_s_ > 0.0 || secondsBetween(*last_frame_, until) <= kNoImageS)
    return;
  char text[80];
  std::snprintf(text, sizeof text, "no image came for %.1f s", secondsBetween(*last_frame_, until));
  const TimeNs since = *last_frame_ + durationNs(kNoImageS);
  if (state_ == PipelineState::kInertial) enter(PipelineState::kDeadReckoning, since, text);
  // In a state that rests on images alone it is said while they are missing, once.
  if (options_.live && state_ != PipelineState::kDeadReckoning && !no_image_said_)
    remark(since, {text});
  no_image_said_ = true;
}

void Pipeline::processAdmitted() {
  while (std::optional<AdmittedInput> input = border_.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*input)) {
      propagate(*sample);
    } else if (std::holds_alternative<ClockJump>(*input)) {
      const std::lock_guard<std::mutex> lock(shared_mutex_);
      propagator_.clockJumped();
    }
    if (!front_queue_)
      runFrontEnd(std::move(*input));
    else
      for (const StereoFrame& late : front_queue_->push(std::move(*input)))
        count(InputFault::kFrameLate, late.t);
  }
}

/** Adds the sample to those kept since the last frame, of which there are no more than the longest
 * gap needs. */
void Pipeline::keepSample(const ImuSample& sample, const std::optional<TimeNs>& last_frame,
                          ImuBuffer* imu) {
  imu->add(sample);
  const TimeNs longest = durationNs(kLongestGapOfFramesS), needed = sample.t - longest;
  const TimeNs oldest = imu->samples().front().t;
  // A camera whose clock is ahead may stop.
  if (last_frame && *last_frame >= needed && oldest >= needed - longest) return;
  const bool is_worth_it = oldest < needed - kNanosecondsPerSecond;
  if (is_worth_it) imu->dropBefore(needed);
}

void Pipeline::runFrontEnd(AdmittedInput input) {
  if (const auto* sample = std::get_if<ImuSample>(&input)) {
    keepSample(*sample, front_.trackedAt(), &front_imu_);
    deliver(*sample);
  } else if (const auto* jump = std::get_if<ClockJump>(&input)) {
    front_imu_ = ImuBuffer();
    deliver(*jump);
  } else {
    ImuBias bias;
    bool in_flight = false;
    {
      const std::lock_guard<std::mutex> lock(shared_mutex_);
      bias = front_bias_;
      in_flight = front_in_flight_;
    }
    FrontFrame frame = front_.process(std::get<StereoFrame>(input), front_imu_, bias, in_flight);
    if (frame.tracked)
      front_imu_.dropBefore(frame.t);
    else
      count(InputFault::kFrameRepeatsImage, frame.t);
    deliver(std::move(frame));
  }
}

void Pipeline::deliver(EstimatorInput input) {
  if (!estimator_queue_)
    estimate(input);
  else
    for (const FrontFrame& late : estimator_queue_->push(std::move(input)))
      count(InputFault::kFrameLate, late.t);
}

void Pipeline::startThreads() {
  front_queue_ = std::make_unique<LiveQueue<AdmittedInput, StereoFrame>>();
  estimator_queue_ = std::make_unique<LiveQueue<EstimatorInput, FrontFrame>>();
  front_thread_ = std::thread(&Pipeline::runStage, this, [this] {
    while (auto input = front_queue_->pop()) runFrontEnd(std::move(*input));
  });
  estimator_thread_ = std::thread(&Pipeline::runStage, this, [this] {
    while (const auto input = estimator_queue_->pop()) estimate(*input);
  });
}

/** In a thread of its own. What it throws ends both stages, and reaches whoever calls next. */
void Pipeline::runStage(const std::function<void()>& stage) {
  try {
    stage();
  } catch (...) {
    {
      const std::lock_guard<std::mutex> lock(shared_mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
    front_queue_->close();
    estimator_queue_->close();
  }
}

void Pipeline::throwFailure() const {
  std::exception_ptr failure;
  {
    const std::lock_guard<std::mutex> lock(shared_mutex_);
    failure = failure_;
  }
  if (failure) std::rethrow_exception(failure);
}

void Pipeline::joinThreads() {
  if (front_queue_) front_queue_->close();
  if (front_thread_.joinable()) front_thread_.join();
  if (estimator_queue_) estimator_queue_->close();
  if (estimator_thread_.joinable()) estimator_thread_.join();
}

void Pipeline::count(InputFault fault, TimeNs t) {
  const std::lock_guard<std::mutex> lock(shared_mutex_);
  InputFaultCount& c = run_faults_[fault];
  if (c.count++ == 0) c.first = t;
}

InputFaultCounts Pipeline::inputFaults() const {
  const std::scoped_lock lock(border_mutex_, shared_mutex_);
  InputFaultCounts faults = border_.faults();
  for (const auto& [fault, of_run] : run_faults_) {
    InputFaultCount& c = faults[fault];
    if (c.count == 0)
      c = of_run;
    else
      c.count += of_run.count;
  }
  return faults;
}

void Pipeline::onFrame(std::function<void(const FrameEstimate&)> listener) {
  on_frame_ = std::move(listener);
}

void Pipeline::onTracks(std::function<void(const FrontFrame&)> listener) {
  on_tracks_ = std::move(listener);
}

void Pipeline::onImuState(std::function<void(const ImuRateState&)> listener) {
  on_imu_state_ = std::move(listener);
}

void Pipeline::propagate(const ImuSample& sample) {
  std::optional<ImuRateState> state;
  {
    const std::lock_guard<std::mutex> lock(shared_mutex_);
    propagator_.add(sample);
    if (on_imu_state_) state = propagatedState(sample.t);
  }
  if (state) on_imu_state_(*state);
}

/** After a frame: what every reader may ask for. */
void Pipeline::publish(const FrameEstimate& estimate) {
  {
    const std::lock_guard<std::mutex> lock(shared_mutex_);
    latest_ = estimate;
    front_bias_ = bias_;
    front_in_flight_ = !collecting();
    if (estimate.state == PipelineState::kInertial ||
        estimate.state == PipelineState::kDeadReckoning)
      propagator_.correct(estimate.t, estimate.nav);
    else
      propagator_.forgetState();
  }
  if (on_frame_) on_frame_(estimate);
}

std::optional<FrameEstimate> Pipeline::latest() const {
  const std::lock_guard<std::mutex> lock(shared_mutex_);
  return latest_;
}

std::optional<ImuRateState> Pipeline::propagatedState(TimeNs t) const {
  const auto nav = propagator_.at(t);
  if (!nav) return std::nullopt;
  const bool no_image = secondsBetween(latest_->t, t) > kNoImageS;
  return ImuRateState{t, no_image ? PipelineState::kDeadReckoning : latest_->state, *nav};
}

std::optional<ImuRateState> Pipeline::stateAt(TimeNs t) const {
  const std::lock_guard<std::mutex> lock(shared_mutex_);
  return propagatedState(t);
}

}  // namespace etalon
