#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/time.h"

namespace etalon {

/** Which images of two cameras belong together. */
struct StereoPairs {
  std::vector<std::pair<size_t, size_t>> pairs;  ///< indices, left and right, increasing
  std::vector<size_t> alone_left, alone_right;   ///< indices of the rest
  double offset_s = 0.0;  ///< median of right less left stamp of the pairs, s
  double spread_s = 0.0;  ///< largest difference from it, s
};

/**
 * Pairs images whose stamps differ by at most `tolerance_s`, each with the nearest of the other
 * camera.
 * @param left, right stamps, each strictly increasing
 */
StereoPairs pairByStamps(const std::vector<TimeNs>& left, const std::vector<TimeNs>& right,
                         double tolerance_s);

/** A sentence on the offset between the cameras; empty if all stamps are equal. */
std::string describeOffset(const StereoPairs& pairs);

/**
 * What to do where no stamps are equal, as the end of a message: by how much the nearest ones
 * differ, and the tolerance that would pair them. Empty if there is nothing to pair.
 * @param within_s of each other, at most
 */
std::string adviseTolerance(const std::vector<TimeNs>& left, const std::vector<TimeNs>& right,
                            double within_s = 10.0);

/** The same, as a sentence, where more than a twentieth of the left images have no counterpart and
 * most of these have one within half a step of the images. Else empty. */
std::string adviseOnAlone(const StereoPairs& found, const std::vector<TimeNs>& left,
                          const std::vector<TimeNs>& right);

}  // namespace etalon
