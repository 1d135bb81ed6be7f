#pragma once

#include <cstdint>
#include <variant>
#include <vector>

#include "../random.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/** Calls `act(fault, index)` for every fault of the kind T, in the order of the list. */
template <typename T, typename Act>
void forEachFault(const std::vector<Fault>& faults, Act act) {
  for (size_t i = 0; i < faults.size(); ++i)
    if (const T* fault = std::get_if<T>(&faults[i])) act(*fault, i);
}

/** The same of those that last at the instant `s`. */
template <typename T, typename Act>
void forEachFaultAt(const std::vector<Fault>& faults, double s, Act act) {
  forEachFault<T>(faults, [&](const T& fault, size_t i) {
    if (fault.during.contains(s)) act(fault, i);
  });
}

/** Whether a fault of the kind T lasts at the instant `s`. */
template <typename T>
bool anyFaultAt(const std::vector<Fault>& faults, double s) {
  bool any = false;
  forEachFaultAt<T>(faults, s, [&](const T&, size_t) { any = true; });
  return any;
}

/** The random numbers of fault number `fault` for image pair number `item`. */
inline Random faultRandom(std::uint64_t seed, size_t fault, size_t item) {
  return Random(mixBits(seed ^ kFaultStream) + fault, item);
}

}  // namespace etalon
