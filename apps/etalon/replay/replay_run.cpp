#include "replay/replay_run.h"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "etalon/core/text.h"
#include "replay/replay_output.h"
#include "support/versions.h"

namespace etalon::app {

namespace {

std::string absolute(const std::string& path) {
  return path.empty() ? path : std::filesystem::absolute(path).lexically_normal().string();
}

}  // namespace

ReplayRun::ReplayRun(SensorSource* source, const RunConfiguration& configuration, RunState* state,
                     const RunEnd* died)
    : source_(*source),
      configuration_(configuration),
      state_(*state),
      died_(died),
      pipeline_(source->calibration(), configuration.pipeline, configuration.initializers) {}

void ReplayRun::keepImuStates() {
  pipeline_.onImuState([this](const ImuRateState& state) { imu_states_.push_back(state); });
}

void ReplayRun::openWindow() { window_.reset(loadFlightWindow()(&pipeline_)); }

void ReplayRun::run() {
  while (auto event = source_.next()) {
    if (state_.stop) {
      interrupted_ = true;
      return;
    }
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      pipeline_.add(*sample);
    } else {
      auto& frame = std::get<StereoFrame>(*event);
      if (died_ && truncateToMrptTick(frame.t) > truncateToMrptTick(*died_->processed)) return;
      if (images_.empty()) state_.first_image = frame.t;
      images_.push_back({frame.t, absolute(frame.left_path), absolute(frame.right_path)});
      pipeline_.add(std::move(frame));
      if (window_) window_->update();
    }
    report(false);
  }
}

void ReplayRun::finish() {
  pipeline_.finish();
  report(true);
}

FinishedRun ReplayRun::finished(double min_coverage) {
  return {source_,    configuration_, pipeline_, images_, 1e-3 * watch_.lapMilliseconds(),
          versions(), min_coverage,   {},        0.0,     std::move(imu_states_)};
}

void ReplayRun::adjust(FinishedRun* run) {
  std::printf("final bundle adjustment...\n");
  std::fflush(stdout);
  FinalFlight flight;
  if (!state_.stop)
    flight = pipeline_.finalBa([this](int iterations) {
      if (!died_)
        progress_.update(false, [iterations] {
          return format("replay: final bundle adjustment: %d iterations", iterations);
        });
      return !state_.stop;
    });
  progress_.interrupt();
  adjustment_stopped_ = state_.stop;
  if (adjustment_stopped_) return;
  run->final_flight = std::move(flight);
  run->final_ba_s = 1e-3 * watch_.lapMilliseconds();
}

void ReplayRun::waitForWindow() {
  if (window_) window_->waitUntilClosed(state_.stop);
}

std::string ReplayRun::interruptedAt() const {
  return interrupted_ ? format("%.2f s", secondsFlown()) : "";
}

double ReplayRun::secondsFlown() const {
  return images_.empty() ? 0.0 : secondsBetween(images_.front().t, images_.back().t);
}

void ReplayRun::report(bool last) {
  if (!pipeline_.estimates().empty()) state_.processed = pipeline_.estimates().back().t;
  if (died_) return;
  for (; reported_ < pipeline_.attempts().size(); ++reported_) {
    progress_.interrupt();
    printAttempt(pipeline_.attempts()[reported_], pipeline_,
                 configuration_.initializers.at_rest_name, images_.front().t);
  }
  for (; events_reported_ < pipeline_.events().size(); ++events_reported_) {
    const PipelineEvent& event = pipeline_.events()[events_reported_];
    if (event.state == PipelineState::kVisual && !event.remark) continue;
    progress_.interrupt();
    printEvent(event, images_.front().t);
  }
  progress_.update(last, [this] {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    return describeProgress(pipeline_, configuration_.pipeline, secondsFlown(), elapsed.count());
  });
}

}  // namespace etalon::app
