#pragma once

#include <chrono>

namespace etalon {

/** Steady-clock time since construction or the last lap, for reports; never for decisions. */
class Stopwatch {
 public:
  /** Milliseconds since construction or the last call. */
  double lapMilliseconds() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace etalon
