#include "etalon/pipeline/pipeline.h"

#include <algorithm>
#include <utility>

#include "estimator.h"
#include "kept_samples.h"

namespace etalon {

Pipeline::Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
                   PipelineInitializers initializers)
    : border_(calibration, options.input),
      front_(calibration, options.frontend),
      estimator_(std::make_unique<Estimator>(calibration, options, std::move(initializers))),
      propagator_(options.imu_noise.apply(calibration.imu.noise), options.window.gravity_mps2,
                  options.input.max_gap_s),
      front_bias_(estimator_->bias()),
      no_image_s_(noImageS(calibration.cameras[0].rate_hz)) {
  if (options.live) startThreads();
}

Pipeline::~Pipeline() { joinThreads(); }

void Pipeline::process(const mrpt::obs::CObservation& observation) {
  throwFailure();
  const std::lock_guard<std::mutex> lock(border_mutex_);
  if (finished_) return;
  for (ObservationInput::Measurement& measurement : observation_input_.convert(observation)) {
    if (const auto* unusable = std::get_if<UnusableObservation>(&measurement)) {
      if (unusable->kind == UnusableObservation::Kind::kBroken)
        border_.count(InputFault::kObservationBroken, unusable->t);
      else if (unusable->kind == UnusableObservation::Kind::kUnpaired)
        border_.count(InputFault::kImageUnpaired, unusable->t);
      continue;
    }
    SensorEvent& event = std::get<SensorEvent>(measurement);
    if (const auto* sample = std::get_if<ImuSample>(&event))
      border_.add(*sample);
    else
      admit(std::move(std::get<StereoFrame>(event)));
    processAdmitted();
  }
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
  if (!again) estimator_->finish();
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
    if (frame.tracked) front_imu_.dropBefore(frame.t);
    if (frame.repeated[0] || frame.repeated[1])
      count(frame.tracked ? InputFault::kImageRepeated : InputFault::kFrameRepeatsImage, frame.t);
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

void Pipeline::estimate(const EstimatorInput& input) {
  if (const auto* frame = std::get_if<FrontFrame>(&input)) {
    if (!estimator_->add(*frame)) return count(InputFault::kFrameFromThePast, frame->t);
    publish(estimator_->estimates().back());
    if (on_tracks_) on_tracks_(*frame);
  } else if (const auto* jump = std::get_if<ClockJump>(&input)) {
    estimator_->add(*jump);
  } else if (estimator_->add(std::get<ImuSample>(input))) {
    const std::lock_guard<std::mutex> lock(shared_mutex_);
    propagator_.forgetState();
  }
}

/** After a frame: what every reader may ask for. */
void Pipeline::publish(const FrameEstimate& estimate) {
  {
    const std::lock_guard<std::mutex> lock(shared_mutex_);
    latest_ = estimate;
    latest_lag_s_ = std::max(0.0, secondsBetween(estimate.t, propagator_.end()));
    front_bias_ = estimator_->bias();
    front_in_flight_ = !estimator_->isCollecting();
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
  const bool no_image = secondsBetween(latest_->t, t) > no_image_s_ + latest_lag_s_;
  return ImuRateState{t, no_image ? PipelineState::kDeadReckoning : latest_->state, *nav};
}

std::optional<ImuRateState> Pipeline::stateAt(TimeNs t) const {
  const std::lock_guard<std::mutex> lock(shared_mutex_);
  return propagatedState(t);
}

PipelineState Pipeline::state() const { return estimator_->state(); }

const std::vector<PipelineEvent>& Pipeline::events() const { return estimator_->events(); }

const std::optional<TimeNs>& Pipeline::initializedAt() const { return estimator_->initializedAt(); }

const std::optional<TimeNs>& Pipeline::handedOverAt() const { return estimator_->handedOverAt(); }

bool Pipeline::waitsForMotion() const { return estimator_->starter().waitsForMotion(); }

const std::vector<FrameEstimate>& Pipeline::estimates() const { return estimator_->estimates(); }

Trajectory Pipeline::trajectory() const { return trajectoryOf(estimates()); }

Trajectory Pipeline::smoothedTrajectory() const { return record().smoothedFlight(trajectory()); }

const FlightRecord& Pipeline::record() const { return estimator_->record(); }

FinalFlight Pipeline::finalBa(const std::function<bool(int iterations)>& go_on) const {
  return estimator_->finalBa(go_on);
}

std::vector<CalibrationFinding> Pipeline::calibrationFindings() const {
  return estimator_->calibrationFindings();
}

StereoInertialCalibration Pipeline::calibrationInUse() const {
  return estimator_->calibrationInUse();
}

const std::vector<InitializationAttempt>& Pipeline::attempts() const {
  return estimator_->starter().attempts();
}

size_t Pipeline::attemptCount() const { return estimator_->starter().attemptCount(); }

const std::vector<FrameTiming>& Pipeline::timings() const { return estimator_->timings(); }

int Pipeline::keyframesCollected() const { return estimator_->keyframesCollected(); }

int Pipeline::framesNotLocated() const { return estimator_->framesNotLocated(); }

const ImuBias& Pipeline::bias() const { return estimator_->bias(); }

}  // namespace etalon
