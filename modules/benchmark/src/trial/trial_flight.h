#pragma once

#include <optional>
#include <vector>

#include "etalon/benchmark/trial/trial_record.h"
#include "etalon/pipeline/pipeline.h"

namespace etalon {

/** What was flown, and what it was given: all that a run is judged by. */
struct Flown {
  std::vector<TimeNs> images;      ///< stamps of the frames that were delivered
  std::optional<TimeNs> fault_at;  ///< first measurement that a fault changed
  std::optional<TimeNs> started;   ///< the odometry with the IMU began; a system: its first pose
  Trajectory causal, smoothed;     ///< `smoothed` is empty for a system
  std::vector<FrameEstimate> estimates;  ///< those of `causal`; empty for a system
  std::vector<PipelineEvent> events;
  std::string end_state;  ///< empty for a system
  std::string refusal;  ///< of the last attempt at starting, in words; a system: why it has no pose
  double frame_ms = WindowErrors::kNone;
};

/** A pipeline that is fed event by event, and the record of its flight. */
class TrialFlight {
 public:
  TrialFlight(const StereoInertialCalibration& calibration, const PipelineOptions& options,
              const PipelineInitializers& initializers)
      : pipeline_(calibration, options, initializers) {}

  void feed(SensorEvent event);
  /** Ends the flight. */
  Flown finish();

 private:
  Pipeline pipeline_;
  std::vector<TimeNs> images_;
};

/** When a run has gone wrong without a word: its position is off by more than so many predicted
 * standard deviations, and by more than so much. */
constexpr double kSilentSigmas = 5.0;
constexpr double kSilentM = 0.1;

/**
 * Fills in what the flight was worth: counts, errors, events, and whether it survived.
 *
 * Survived: it started; every frame since the fault has a pose (without a fault: since the first
 * pose), and so have half of all; the causal ATE is within the limit; it does not end `lost`; and it was nowhere wrong without an event since the fault saying so
 * (kSilentSigmas).
 * @param run names what flew
 * @param ground_truth of what was delivered; may be empty
 */
void judge(const Flown& flown, const GroundTruth& ground_truth, const TrialProtocol& protocol,
           TrialRun* run);

/** The flight of another system: its poses within half a frame of one that was delivered. Where
 * poses are given and none lies there, `refusal` says so. */
Flown flownBySystem(const Trajectory& trajectory, const std::vector<TimeNs>& images,
                    const std::optional<TimeNs>& fault_at);

/** Of a run whose fault changed no measurement: it does not count, unless it was broken off. */
void setFaultNotMet(TrialRun* run);

}  // namespace etalon
