#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "etalon/core/stopwatch.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/pipeline/pipeline.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/report/run_results.h"
#include "gui/load_flight_window.h"
#include "support/progress_line.h"
#include "support/supervised_run.h"

namespace etalon::app {

/** The pipeline's run over a source, with its progress on the screen. After an error it keeps what
 * was flown before. */
class ReplayRun {
 public:
  /** @param died how an earlier run of the same input crashed: this run stops before that point and
   * reports no progress; null: there was no earlier run */
  ReplayRun(SensorSource* source, const RunConfiguration& configuration, RunState* state,
            const RunEnd* died);

  void keepImuStates();
  void openWindow();

  /** To the end of the source, or until the run shall stop. */
  void run();

  void finish();
  FinishedRun finished(double min_coverage);

  /** The final bundle adjustment; what is not finished is dropped. */
  void adjust(FinishedRun* run);

  /** Whether the final bundle adjustment was wanted, but was told to stop. */
  bool adjustmentStopped() const { return adjustment_stopped_; }

  void waitForWindow();

  /** "3.20 s" after the first image, if the run was interrupted; else empty. */
  std::string interruptedAt() const;

  const Pipeline& pipeline() const { return pipeline_; }

  /** Stereo pairs that the source gave. */
  size_t delivered() const { return images_.size(); }

 private:
  void report(bool last);
  double secondsFlown() const;

  SensorSource& source_;
  const RunConfiguration& configuration_;
  RunState& state_;
  const RunEnd* died_;
  Pipeline pipeline_;
  std::vector<StereoReference> images_;
  std::vector<ImuRateState> imu_states_;
  std::unique_ptr<FlightWindow> window_;
  ProgressLine progress_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Stopwatch watch_;
  size_t reported_ = 0, events_reported_ = 0;
  bool interrupted_ = false, adjustment_stopped_ = false;
};

}  // namespace etalon::app
