#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "etalon/core/time.h"
#include "etalon/initialization/initializer.h"

namespace etalon::app {

/** The progress of a run, in memory shared with its supervisor. */
struct RunState {
  std::atomic<TimeNs> first_image{-1};     ///< of the run; -1: none yet
  std::atomic<TimeNs> processed{-1};       ///< last frame that the pipeline has processed; -1: none
  std::atomic<std::uint64_t> attempts{0};  ///< calls of an initializer that have begun
  std::atomic<bool> in_attempt{false};
  std::atomic<TimeNs> attempt_t{0};  ///< last keyframe of the window of the last attempt
  char initializer[64] = "";         ///< of the last attempt
  std::atomic<bool> finished{false};
  std::atomic<bool> stop{false};  ///< the run shall come to an orderly end
};

/** How a supervised run ended. */
struct RunEnd {
  bool finished = false;
  int exit_code = 0;  ///< if finished
  /** Otherwise what happened instead, as the end of a sentence: "crashed with signal 11
   * (Segmentation fault)", "used more than 60 s of processor time". */
  std::string how;
  bool out_of_time = false;
  // The state at the end:
  std::string initializer;  ///< the one that was running; empty: none
  TimeNs attempt_t = 0;     ///< last keyframe of its window, if one was running
  std::uint64_t attempts = 0;
  std::optional<TimeNs> first_image, processed;
};

/**
 * Runs `run` in a child process, in which it may crash or loop without harm to this one. An
 * initializer's call that uses more processor time than `limit_s`, or waits that long, is ended
 * with the child.
 *
 * To be called while this process has one thread.
 * @param stop as of stopOnSignals(): becomes RunState::stop, and the child itself leaves SIGINT and
 *        SIGTERM alone; null: these end it
 * @throws Error if no process can be started
 */
RunEnd runSupervised(double limit_s, const std::function<int(RunState& state)>& run,
                     const std::atomic<bool>* stop = nullptr);

/** Wraps the initializer so that `state` shows when it is called and when it has returned. */
std::shared_ptr<const Initializer> watched(std::shared_ptr<const Initializer> initializer,
                                           const std::string& name, RunState* state);

}  // namespace etalon::app
