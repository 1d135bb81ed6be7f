#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace etalon {

/** Calls work(0) ... work(count - 1) from `jobs` threads; the calls begin in this order. The first
 * exception ends the work and is thrown here. */
template <typename Work>
void inParallel(int jobs, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto worker = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> threads;
  const auto others = std::min<std::size_t>(count, std::max(1, jobs));
  try {
    threads.reserve(others);
    for (std::size_t i = 1; i < others; ++i) threads.emplace_back(worker);
  } catch (const std::exception&) {  // no more threads, or no memory for them: go on with fewer
  }
  worker();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace etalon
