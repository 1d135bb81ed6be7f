#pragma once

#include <string>

#include "etalon/benchmark/benchmark_record.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/** One window of a recording, which initializers try. */
class SlotTrial {
 public:
  /**
   * @param slot names sequence, segment and window
   * @param floor of the recording
   * @param every_s from slot to slot
   */
  SlotTrial(const SlotRecord& slot, const SequenceTracks& tracks, const GroundTruthFloor& floor,
            double every_s, const ImuNoiseOptions& noise, const WindowOptions& options);

  /** Initializer, VI-BA and acceptance. */
  SlotRecord tryWith(const ConfiguredInitializer& initializer) const;
  /** The record of an initializer that did not come back.
   * @param how as the end of a sentence: "crashed with signal 11 (Segmentation fault)" */
  SlotRecord lost(const std::string& initializer, const std::string& status,
                  const std::string& how) const;

 private:
  SlotRecord before_;  ///< what is known before an initializer has tried it
  const SequenceTracks& tracks_;
  const GroundTruthFloor& floor_;
  WindowOptions options_;
  InitializationProblem problem_;
};

}  // namespace etalon
