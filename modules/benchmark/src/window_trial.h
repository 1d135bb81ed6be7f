#pragma once

#include <map>
#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/pipeline/keyframe_window.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** One window of a recording, which initializers try; or windows that grow as in a run (Starter),
 * until a start is accepted. */
class WindowTrial {
 public:
  /**
   * @param result names sequence, window and its shape
   * @param ground_truth_check of the recording
   * @param protocol says how far apart windows are, and whether they grow
   */
  WindowTrial(const WindowResult& result, const SequenceTracks& tracks,
              const GroundTruthCheck& ground_truth_check, const BenchmarkProtocol& protocol,
              const ImuNoiseOptions& noise, const WindowOptions& options);

  /** Runs initializer, VI-BA and acceptance. */
  WindowResult tryWith(const ConfiguredInitializer& initializer) const;
  /** The record of an initializer that did not come back.
   * @param how as the end of a sentence: "crashed with signal 11 (Segmentation fault)" */
  WindowResult lost(const std::string& initializer, const std::string& status,
                    const std::string& how) const;

 private:
  void describe(const std::vector<TimeNs>& keyframes, WindowResult* result) const;
  InitializationAttempt grow(const ConfiguredInitializer& initializer) const;
  InitializationProblem problemOf(const KeyframeWindow& window, const WindowOptions& options) const;
  WindowResult record(const InitializationAttempt& attempt) const;

  WindowShape shape_;
  int first_keyframes_;  ///< of the first window that is tried
  const SequenceTracks& tracks_;
  const GroundTruthCheck& ground_truth_check_;
  ImuNoiseOptions noise_;
  WindowOptions options_;
  InitializationProblem whole_;
  WindowResult before_;  ///< of the whole window, what is known before an initializer has tried it
  /** Of windows that grow, by their keyframes. */
  mutable std::map<std::vector<TimeNs>, InitializationProblem> problems_;
};

}  // namespace etalon
