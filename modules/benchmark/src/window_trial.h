#pragma once

#include <string>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** One window of a recording, which initializers try. */
class WindowTrial {
 public:
  /**
   * @param result names sequence, window and its shape
   * @param ground_truth_check of the recording
   * @param every_s from window to window
   */
  WindowTrial(const WindowResult& result, const SequenceTracks& tracks,
              const GroundTruthCheck& ground_truth_check, double every_s,
              const ImuNoiseOptions& noise, const WindowOptions& options);

  /** Runs initializer, VI-BA and acceptance. */
  WindowResult tryWith(const ConfiguredInitializer& initializer) const;
  /** The record of an initializer that did not come back.
   * @param how as the end of a sentence: "crashed with signal 11 (Segmentation fault)" */
  WindowResult lost(const std::string& initializer, const std::string& status,
                    const std::string& how) const;

 private:
  WindowResult before_;  ///< what is known before an initializer has tried it
  const SequenceTracks& tracks_;
  const GroundTruthCheck& ground_truth_check_;
  WindowOptions options_;
  InitializationProblem problem_;
};

}  // namespace etalon
