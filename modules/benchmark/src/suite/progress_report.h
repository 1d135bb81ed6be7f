#pragma once

#include <functional>
#include <mutex>
#include <utility>

#include "etalon/benchmark/benchmark.h"
#include "etalon/core/stopwatch.h"

namespace etalon {

/** Calls the caller's progress function, one thread at a time. */
class ProgressReport {
 public:
  ProgressReport(std::function<void(const BenchmarkProgress&)> call, BenchmarkProgress::Stage stage,
                 size_t total)
      : call_(std::move(call)) {
    progress_.stage = stage;
    progress_.total = total;
  }

  void add(size_t done) {
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_.done += done;
    progress_.elapsed_s += 1e-3 * watch_.lapMilliseconds();
    if (!call_ || progress_.done == 0) return;
    progress_.remaining_s = progress_.elapsed_s / static_cast<double>(progress_.done) *
                            static_cast<double>(progress_.total - progress_.done);
    call_(progress_);
  }

 private:
  std::function<void(const BenchmarkProgress&)> call_;
  std::mutex mutex_;
  BenchmarkProgress progress_;
  Stopwatch watch_;
};

}  // namespace etalon
