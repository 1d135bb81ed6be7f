#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "etalon/core/time.h"
#include "etalon/core/trajectory.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/** What faults do to stamps: which pairs of images are kept, and when everything seems to be. */
class FaultTimeline {
 public:
  /** @param image_stamps of the recording, before the faults
   *  @param zero the instant from which the faults' seconds count */
  FaultTimeline(const std::vector<Fault>& faults, const std::vector<TimeNs>& image_stamps,
                TimeNs zero, std::uint64_t seed);

  /** s after the scenario's zero. */
  double seconds(TimeNs t) const { return secondsBetween(zero_, t); }
  /** The stamp after the clock's jumps. */
  TimeNs jumped(TimeNs t) const;

  /** Number of the pair of images with this stamp; nothing if there is none. */
  std::optional<size_t> indexOf(TimeNs t) const;
  /** The stamp of a pair of images after the faults; nothing if it is not delivered. */
  const std::optional<TimeNs>& stampOf(size_t index) const { return stamps_[index]; }

  /** Of the pairs that are delivered, after the faults. */
  const std::vector<TimeNs>& imageStamps() const { return kept_; }

  /** By how much the stamp of an image may come before that of an IMU sample of its instant, ns. */
  TimeNs mostEarly() const { return most_early_; }

 private:
  bool keeps(const std::vector<Fault>& faults, size_t index, std::uint64_t seed) const;

  TimeNs zero_ = 0, most_early_ = 0;
  struct Jump {
    double from_s = 0.0;
    TimeNs by = 0;
  };
  std::vector<Jump> jumps_;
  std::vector<TimeNs> before_;  ///< the recording's stamps
  std::vector<std::optional<TimeNs>> stamps_;
  std::vector<TimeNs> kept_;
};

/** The ground truth after the faults: its clock jumps, its biases do. */
GroundTruth faultyTruth(GroundTruth truth, const std::vector<Fault>& faults,
                        const FaultTimeline& timeline, std::uint64_t seed);

}  // namespace etalon
