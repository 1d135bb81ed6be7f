#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/time.h"
#include "etalon/evaluation/metrics.h"
#include "etalon/imu/imu_sample.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/initialization/steps/time_offset_of_rotations.h"

namespace etalon {

/** Names of the stages of an attempt, as they stand in files. */
constexpr const char* kStageInit = "init";   ///< the initializer's own result
constexpr const char* kStageViBa = "vi_ba";  ///< after visual-inertial BA
/** Names of the timings that every attempt has; an initializer may add its own. */
constexpr const char* kTimingStereoOdometry =
    "stereo_odometry";  ///< stereo odometry, where it was asked for
constexpr const char* kTimingInitialize =
    "initialize";  ///< the initializer without stereo odometry
constexpr const char* kTimingViBa = kStageViBa;
constexpr const char* kStatusSuccess = "success";
// Statuses of a benchmark's window, beside those of RefusalStatus:
constexpr const char* kStatusCrashed = "crashed";  ///< the process died, or an exception got out
constexpr const char* kStatusTimeLimit = "time_limit";  ///< it was ended after its processor time

/** What one stage of an attempt estimated. */
struct StageRecord {
  std::string stage;                 ///< kStageInit or kStageViBa
  std::vector<StampedState> states;  ///< one a keyframe
  ImuBias bias;
  double gravity_mps2 = 0.0;                             ///< magnitude
  Eigen::Vector3d gravity_B0 = Eigen::Vector3d::Zero();  ///< in the first keyframe's body, m/s^2
  Eigen::MatrixXd covariance;                            ///< square; empty where there is none
  std::string covariance_order;                          ///< in words: the meaning of its rows
  std::optional<WindowErrors> errors;                    ///< where there is ground truth

  /** Gravity in the first keyframe's body, R_WB0^T (0, 0, -g), from the states. */
  static StageRecord fromStates(const std::string& stage, std::vector<StampedState> states,
                                const ImuBias& bias, double gravity_mps2);
};

/** One attempt at initializing. */
struct AttemptRecord {
  TimeNs t = 0;                   ///< stamp of the last keyframe
  std::string initializer;        ///< its name where a run has several; else empty
  std::vector<TimeNs> keyframes;  ///< stamps of the window's keyframes
  std::string status;             ///< toString(RefusalStatus), or "success": accepted
  std::string reason;             ///< why not, in words; empty on success
  /** The number behind the reason, and the bound that it breaks; NaN where there is none. */
  double reason_value = WindowErrors::kNone, reason_bound = WindowErrors::kNone;
  std::vector<StageRecord> stages;   ///< those that were reached
  std::vector<StageTiming> timings;  ///< ms, steady clock
  std::optional<FoundExtrinsics> extrinsics;
  std::optional<RotationTimeOffset> time_offset;  ///< InitializationAttempt::time_offset
  double time_offset_used_s = 0.0;

  bool accepted() const { return status == kStatusSuccess; }
  /** The stage of this name; null if it was not reached. */
  const StageRecord* stage(const std::string& name) const;
  /** Milliseconds of the timing of this name; NaN if there is none. */
  double milliseconds(const std::string& name) const;
};

/** A kind of broken input, and how often it was seen (InputBorder). */
struct InputFaultRecord {
  std::string fault;  ///< toString(InputFault)
  int count = 0;
  TimeNs first = 0;    ///< stamp of the first
  double value = 0.0;  ///< of the first: a rate, a step in seconds...
};

/** Wall time of a stage per frame that it processed. */
struct StageTimes {
  std::string stage;  ///< "front_end", "odometry", "initialization"
  int frames = 0;
  double median_ms = WindowErrors::kNone, p99_ms = WindowErrors::kNone, max_ms = 0.0;
  double total_s = 0.0;
};

/** Counts and times of a whole run. */
struct RunStatistics {
  int stereo_frames = 0, imu_samples = 0;
  int unpaired_left = 0, unpaired_right = 0;
  int unreadable_images = 0;                   ///< pairs skipped
  int frames_not_located = 0;                  ///< frames whose pose is a prediction
  std::vector<InputFaultRecord> input_faults;  ///< what was dropped or bridged; empty if nothing
  double duration_s = 0.0;                     ///< from the first to the last delivered image
  double wall_s = WindowErrors::kNone;
  double frame_median_ms = WindowErrors::kNone;  ///< front end and odometry of a stereo frame
  std::vector<StageTimes> stages;
};

/** A change of the pipeline's state, or a remark (PipelineEvent). */
struct EventRecord {
  TimeNs t = 0;
  std::string state;    ///< toString(PipelineState): the new one
  std::string reason;   ///< a clause
  bool remark = false;  ///< the state is as before
  /** At a start in flight: the jump of the pose, and the standard deviations of position and yaw; m
   * and deg. */
  struct Jump {
    double translation_m = 0.0, rotation_deg = 0.0;
    double sigma_position_m = 0.0, sigma_rotation_deg = 0.0;
  };
  std::optional<Jump> jump;
};

/** How many of a run's frames the ground truth covers. */
struct GroundTruthUse {
  int frames = 0;          ///< of the trajectory
  int covered_frames = 0;  ///< of these, with ground truth
};

/** What the flight said of one quantity of the calibration (CalibrationFinding). */
struct CalibrationRecord {
  std::string group, quantity, unit, verdict, words;
  std::vector<double> value, sigma;  ///< what is true less what was given; in the unit
  std::vector<double> used;          ///< what of it the odometry used at the end
};

/** The bundle adjustment over the whole flight (--final-ba). */
struct FinalBaRecord {
  int keyframes = 0, landmarks = 0;
  int pixels = 0, inlier_pixels = 0;
  double noise_factor = 1.0;  ///< a pixel's standard deviation over [odometry] sigma_px
  int iterations = 0;
  std::string termination;  ///< toString(Termination)
  double wall_s = WindowErrors::kNone;
};

/** A run: what initialization.json and the comment in run.rawlog hold. */
struct RunRecord {
  std::string source;       ///< path of the recording
  std::string source_kind;  ///< "euroc" or "rawlog"
  /** With `initializer = auto`: "auto", and version and path of the one for motion. */
  std::string initializer, initializer_version, initializer_path;
  /** With `initializer = auto`: the one for the start at rest; else empty. */
  std::string at_rest_initializer, at_rest_initializer_version, at_rest_initializer_path;
  std::map<std::string, std::string> versions;  ///< of the program and the libraries behind it
  std::string config;                           ///< the effective configuration, INI text
  TimeNs first_image = 0;                       ///< of the run
  std::optional<TimeNs> initialized_at;
  std::optional<TimeNs> handed_over_at;  ///< from the start at rest to the one for motion
  std::vector<AttemptRecord> attempts;
  std::vector<EventRecord> events;
  std::vector<CalibrationRecord> calibration;
  RunStatistics statistics;
  std::vector<std::string> warnings;
  std::optional<GroundTruthUse> ground_truth;  ///< where the recording has some
  /** The whole trajectory, if covered enough: positions aligned in SE(3), rotations in yaw. */
  std::optional<TrajectoryErrors> trajectory_errors;
  /** The same for trajectory_smoothed.tum, and for trajectory_final.tum where it was asked for. */
  std::optional<TrajectoryErrors> smoothed_errors, final_errors;
  std::optional<FinalBaRecord> final_ba;

  /** The attempt that was accepted, the first one; null if there is none. */
  const AttemptRecord* acceptedAttempt() const;
};

/** Version of the JSON; raised when the meaning of a key changes. */
constexpr int kRunFormatVersion = 1;
constexpr const char* kRunFormat = "etalon run";

/**
 * JSON text: an object with "format", "version" and the record's members, units in the names of
 * keys. Numbers are read back bit for bit (rotations, stored as quaternions, to rounding); a NaN is
 * null.
 */
std::string toJson(const RunRecord& record);

/**
 * @param name stands for the text in messages
 * @throws DataError naming `name`, the place in the JSON and what was expected there
 */
RunRecord runRecordFromJson(const std::string& json, const std::string& name);

/** initialization.json. @throws DataError if it cannot be written */
void writeInitializationJson(const std::string& path, const RunRecord& record);

}  // namespace etalon
