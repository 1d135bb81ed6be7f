#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/record.h"

namespace etalon {

/** Which runs a trial has, and when one of them has failed. */
struct TrialProtocol {
  double seconds = 12.0;       ///< length of a run; 0: to the end of the recording
  int starts = 6;              ///< instants of a recording, evenly over it, if `from_s` is empty
  std::vector<double> from_s;  ///< instants, seconds after the first image
  double ate_limit_m = 0.5;    ///< a run whose causal ATE is larger has failed
  int seed = 1;                ///< of the faults
};

/** Name of the scenario without a fault, which every trial has. */
constexpr const char* kNoFault = "none";

/** TrialRun::status. Or kStatusCrashed, kStatusTimeLimit. */
constexpr const char* kStatusSurvived = "survived";
constexpr const char* kStatusFailed = "failed";
/** It did not fail, but ground truth does not tell its ATE. */
constexpr const char* kStatusNotJudged = "not judged";
/** The fault changed no measurement of the run: it is the run without the fault once more. */
constexpr const char* kStatusFaultNotMet = "fault not met";

/** A name with the text that it stands for: a setting with its configuration, a fault with its
 * line, a system with its folder. */
struct NamedText {
  std::string name, text;

  bool operator==(const NamedText& o) const { return name == o.name && text == o.text; }
  bool operator!=(const NamedText& o) const { return !(*this == o); }
};

/** What flew: a configuration of ours, or another system whose trajectories were given. */
struct TrialVariant {
  std::string system;  ///< empty: ours
  std::string setting, odometry, initializer;

  bool operator==(const TrialVariant& other) const {
    return system == other.system && setting == other.setting && odometry == other.odometry &&
           initializer == other.initializer;
  }
};

/** Errors of a trajectory against ground truth; NaN where they are not known. */
struct TrialErrors {
  double ate_m = WindowErrors::kNone;         ///< RMSE of positions aligned in SE(3)
  double ate_yaw_m = WindowErrors::kNone;     ///< aligned in yaw and position alone
  double rotation_deg = WindowErrors::kNone;  ///< RMSE, after the latter
  double rpe_m = WindowErrors::kNone;         ///< RMSE of the motion over a second
  double rpe_deg = WindowErrors::kNone;
};

/** Errors of the causal trajectory from the start of the odometry until some time after it. */
struct ErrorsAfterStart {
  double after_s = 0.0;                       ///< 0: to the end of the run
  double ate_m = WindowErrors::kNone;         ///< RMSE, aligned in yaw and position
  double velocity_mps = WindowErrors::kNone;  ///< RMSE of the vector
  double tilt_deg = WindowErrors::kNone;      ///< RMSE of roll and pitch
};

/** One flight of one variant over a part of a recording, with or without a fault: a row of
 * runs.csv. Times count from the first image of the part. */
struct TrialRun {
  std::string recording;
  double from_s = 0.0;  ///< of the part, after the first image of the recording
  TrialVariant variant;
  std::string fault;  ///< kNoFault or the scenario's name

  std::string status;    ///< kStatusSurvived, ...
  std::string reason;    ///< why it failed or does not count; empty if it survived
  bool silent = false;   ///< it was wrong, and no event said so
  double seconds = 0.0;  ///< from the first image to the last
  int images = 0;        ///< pairs of images in the part of the recording
  int frames = 0;        ///< of these, delivered: what a fault left over; all if it was broken off
  int poses = 0;         ///< frames that have a causal pose
  double fault_at_s = WindowErrors::kNone;  ///< first measurement that the fault changed
  double started_s = WindowErrors::kNone;   ///< odometry with the IMU began; a system: first pose
  std::string end_state;                    ///< of the pipeline; empty: a system
  double dead_reckoning_s = WindowErrors::kNone, lost_s = WindowErrors::kNone;
  std::string event;  ///< the first one since the fault, in words; empty: nothing was reported
  TrialErrors causal, smoothed;
  /** RMS of the position's error since the start over that of its predicted standard deviation. */
  double error_over_predicted = WindowErrors::kNone;
  std::vector<ErrorsAfterStart> after_start;
  double frame_ms = WindowErrors::kNone;  ///< median of front end and odometry

  double coverage() const { return frames > 0 ? static_cast<double>(poses) / frames : 0.0; }
  bool survived() const { return status == kStatusSurvived; }
  /** Whether it counts: it survived, or it did not. */
  bool judged() const { return status != kStatusNotJudged && status != kStatusFaultNotMet; }
};

/** After which times ErrorsAfterStart are given, s; 0: at the end. */
const std::vector<double>& timesAfterStart();

/** A trial: what its folder holds. */
struct TrialRecord : SuiteRecord {
  TrialProtocol protocol;
  std::vector<NamedText> settings;  ///< with their configurations; one without a name: the only one
  std::vector<std::string> odometries;  ///< values of [odometry] kind
  std::vector<NamedText> faults;        ///< the first is kNoFault
  std::vector<NamedText> systems;       ///< trajectories of others, with their folders
  /** In order of recording, instant, variant, fault (each as listed above). */
  std::vector<TrialRun> results;
};

/** The variants of a trial, in order: by setting, odometry, initializer; then the systems. */
std::vector<TrialVariant> variantsOf(const TrialRecord& record);

/** What tells the variant from the others of the trial: "eta", "stereo_visual eta", "wide: eta". */
std::string labelOf(const TrialVariant& variant, const TrialRecord& record);

/** The instants of a recording, s after its first image. Nothing where it is too short. */
std::vector<double> startsOf(const TrialProtocol& protocol, const BenchmarkSequence& sequence);

/** Which runs are left out because recordings that could be used are too short, a sentence each:
 * "NAME: too short for runs of 12 s (needs 11.90 s, has 6.95 s): 0 runs". */
std::vector<std::string> tooShort(const TrialRecord& record);

/** The unique key of a run, in words. */
std::string resultKey(const TrialRun& run);

/** Name of the trajectory of a run in the folder of a variant or system:
 * fileName() of RECORDING-FROM-FAULT, FROM as `%g`, and `.tum`. */
std::string trajectoryName(const std::string& recording, double from_s, const std::string& fault);

/** Name of the folder of a variant. */
std::string folderName(const TrialVariant& variant);

/** The text of runs.csv (docs/trial.md): header, numbers as %.9g, the time in the last column. */
std::string runsCsv(const std::vector<TrialRun>& runs);

}  // namespace etalon
