#pragma once

#include <string>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** One window of a recording, which initializers try; or windows that grow from one keyframe to the
 * next, as in a run (confirm()), until a start is accepted. */
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
  struct Window {
    WindowResult before;  ///< what is known before an initializer has tried it
    InitializationProblem problem;
  };
  Window windowOf(const WindowResult& result, int keyframes, double every_s,
                  const ImuNoiseOptions& noise) const;
  WindowResult record(const Window& window, const InitializationAttempt& attempt) const;

  const SequenceTracks& tracks_;
  const GroundTruthCheck& ground_truth_check_;
  WindowOptions options_;
  std::vector<Window> windows_;  ///< each holds those before it
};

}  // namespace etalon
