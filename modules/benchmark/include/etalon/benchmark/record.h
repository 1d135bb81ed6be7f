#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/ground_truth_check.h"
#include "etalon/evaluation/gyro_agreement.h"
#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/** Share of the poses of a trajectory, or of the keyframes of a window, that must have ground
 * truth before errors are given. */
constexpr double kMinCoverage = 0.5;

/** Which windows of a recording are tried, and which of them are judged. */
struct BenchmarkProtocol {
  double every_s = 2.5;               ///< from window to window
  std::vector<int> keyframes{10};     ///< of a window; every one is combined with every rate
  std::vector<double> rates_hz{4.0};  ///< keyframes a second
  bool vi_ba = true;                  ///< visual-inertial BA and acceptance after the initializer
  /** Keyframes from which a window grows to `keyframes`, until a start is accepted; 0: it does not. */
  int min_keyframes = 0;
  double min_coverage = kMinCoverage;  ///< share of a window's keyframes that need ground truth
};

/** Length and rate of a window. */
struct WindowShape {
  int keyframes = 10;
  double rate_hz = 4.0;

  bool operator==(const WindowShape& other) const {
    return keyframes == other.keyframes && rate_hz == other.rate_hz;
  }
  bool operator!=(const WindowShape& other) const { return !(*this == other); }
};

/** A recording of the benchmark. */
struct BenchmarkSequence {
  std::string name;  ///< unique in the benchmark
  std::string source, source_kind;
  std::string content;  ///< hash of the recording's files; empty where no window of it was tried
  TimeNs first_image = 0, last_image = 0;
  double duration_s = 0.0;
  int stereo_frames = 0;  ///< in the recording
  int unreadable_images = 0;
  bool has_ground_truth = false;
  std::vector<std::string> warnings;  ///< from opening it
  GroundTruthCheck ground_truth_check;
  GyroAgreement gyro_agreement;
  double frontend_ms = WindowErrors::kNone;  ///< median of the front end's frames, decoding apart
  std::string error;                         ///< why it could not be used; empty if it could
};

/** An initializer as it was used. */
struct BenchmarkInitializer {
  std::string name, version, description;
  std::string binary;  ///< hash of the plugin's file
  std::string config;  ///< its section, INI text
};

/** One window of one sequence, tried by one initializer. */
struct WindowResult {
  std::string sequence;
  int window = 0;  ///< its number: it starts window * every_s after the first image
  TimeNs t0 = 0;   ///< stamp of the window's first keyframe
  int keyframes = 0;
  double rate_hz = 0.0;
  std::string initializer;
  /** Stages that were reached, their errors, status and reason. No covariances. Of a window that
   * grew, the attempt that was accepted, or the last; its timings are those of all attempts. */
  AttemptRecord attempt;
  /** Ground truth at the window's keyframes, where there is any. */
  std::vector<StampedState> truth;
  WindowTruthCheck truth_check;
  std::optional<NoiseCheck> noise;  ///< of the VI-BA

  /** From the window's first keyframe to the attempt's last, s; NaN without. */
  double seconds() const;
  WindowShape shape() const { return {keyframes, rate_hz}; }
};

/** What the results of a benchmark or trial were made of, and which part of them is there. */
struct SuiteRecord {
  std::map<std::string, std::string> versions;  ///< of the program and the libraries behind it
  std::string binaries;       ///< hash of the program's own binaries, plugins apart
  int shard = 1, shards = 1;  ///< which part of the work was done
  std::string config;         ///< of the pipeline, effective, INI text
  std::vector<BenchmarkInitializer> initializers;
  std::vector<BenchmarkSequence> sequences;
};

/** A benchmark: what its folder holds. */
struct BenchmarkRecord : SuiteRecord {
  BenchmarkProtocol protocol;
  /** In order of sequence, keyframes, rate, window, initializer (each as listed above). */
  std::vector<WindowResult> results;
};

/** One row of windows.csv (docs/evaluation.md). */
struct WindowRow {
  std::string sequence;
  int window = 0;
  TimeNs t0 = 0;
  int keyframes = 0;
  double rate_hz = 0.0;
  std::string initializer;
  std::string stage;  ///< kStageInit or kStageViBa
  std::string status, reason;
  WindowErrors errors;                    ///< NaN where there is no estimate or no ground truth
  double window_s = WindowErrors::kNone;  ///< WindowResult::seconds()
  /** init: the initializer without stereo odometry; vi_ba: the VI-BA. */
  double runtime_ms = WindowErrors::kNone;

  /** Status success, gravity < 2 deg and velocity < 0.1 m/s. Nothing where this cannot be judged,
   * because an estimate has no ground truth. */
  std::optional<bool> success() const;
  /** Status success, but no success, or outside of what the estimate's own covariance claims
   * (WindowErrors::outsideClaim()). Nothing where this cannot be judged. */
  std::optional<bool> falseAccept() const;
  /** What makes it a false accept, such as "no success" or "tilt, velocity"; empty if it is none,
   * nothing where this cannot be judged. */
  std::optional<std::string> falseAcceptReason() const;
};

/**
 * The row of a stage. init: `success` if the initializer gave an estimate. vi_ba: `success` if the
 * estimate was accepted; one that was not accepted keeps its errors. A stage that was not reached
 * has the status and the reason that stopped the attempt.
 */
WindowRow windowRow(const WindowResult& result, const std::string& stage);

/** All rows, in the order of the results; init before vi_ba, if the protocol has VI-BA. */
std::vector<WindowRow> windowRows(const BenchmarkRecord& record);

/** The text of windows.csv: RFC 4180, header, numbers as %.9g, empty where there is none. */
std::string windowsCsv(const std::vector<WindowRow>& rows);

}  // namespace etalon
