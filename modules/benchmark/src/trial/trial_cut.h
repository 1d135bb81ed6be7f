#pragma once

#include <memory>
#include <string>
#include <vector>

#include "etalon/datasets/sensor_source.h"
#include "etalon/simulation/faults/faulty_source.h"

namespace etalon {

/**
 * A part of a recording that is flown many times: read once and kept in memory, images decoded,
 * where they fit into kMostBytes; else read anew by every flight.
 */
class TrialCut {
 public:
  static constexpr double kMostBytes = 768.0 * 1024 * 1024;

  /** @param seconds length; 0: to the end
   * @param ground_truth SourceOptions::ground_truth
   * @throws DataError as openSource() and its next() do */
  TrialCut(const std::string& source, double from_s, double seconds, double most_bytes = kMostBytes,
           const std::string& ground_truth = "");

  /** Delivers the part from its beginning. May not outlive the cut. */
  std::unique_ptr<SensorSource> open() const;

  double fromS() const { return options_.from_s; }

 private:
  struct Held;
  class HeldSource;

  std::string source_;
  SourceOptions options_;
  std::shared_ptr<const Held> held_;
};

/** A part with a fault, read up to the first measurement that the fault changed. */
struct FaultyCut {
  std::unique_ptr<SensorSource> source;
  size_t same = 0;                   ///< events before that one
  std::optional<SensorEvent> first;  ///< that one; nothing: the fault left none from there on
  std::optional<TimeNs> changed_at;  ///< its stamp, or that of what is missing; nothing: no change
};

/** The cut with a scenario that begins with it. The same seed gives the same measurements. */
FaultyCut faultyCut(const TrialCut& cut, const FaultScenario& scenario, int seed);

}  // namespace etalon
