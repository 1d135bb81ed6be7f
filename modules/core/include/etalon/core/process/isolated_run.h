#pragma once

#include <functional>
#include <string>

namespace etalon {

/** What a child process may use. */
struct IsolationLimits {
  double cpu_s = 30.0;      ///< processor time; rounded up to whole seconds
  double clock_s = 0.0;     ///< time on the clock, for what waits without computing; 0: twice cpu_s
  double memory_gib = 2.0;  ///< of address space besides the caller's own; beyond it `new`
                            ///< throws. Not with sanitizers

  double clockSeconds() const { return clock_s > 0.0 ? clock_s : 2.0 * cpu_s; }
};

/** How a function ended that ran in a process of its own. */
struct IsolatedOutcome {
  bool completed = false;    ///< the function returned
  bool out_of_time = false;  ///< it was ended because it used up its processor or clock time
  std::string output;        ///< what it returned, if completed
  /** Otherwise what happened instead, as the end of a sentence: "crashed with signal 11
   * (Segmentation fault)", "used more than 30 s of processor time", "ended the process with exit
   * code 0", "threw ...". */
  std::string failure;
};

/**
 * Runs `function` in a child process and returns its string: whatever it does, crash, loop, exit,
 * the caller goes on. What it writes to standard output goes to standard error.
 *
 * For programs with one thread: of several only the calling one lives on in the child.
 * @throws Error if no process can be started
 */
IsolatedOutcome runIsolated(const std::function<std::string()>& function,
                            const IsolationLimits& limits);

/** Takes a text. */
using TextSink = std::function<void(const std::string& text)>;

/**
 * The same for a function that has results before it ends: what it gives to `tell`, in the child,
 * the caller's `told` receives at once, in order, also when the child then crashes.
 * @throws what `told` throws; the child is ended first
 */
IsolatedOutcome runIsolated(const std::function<std::string(const TextSink& tell)>& function,
                            const IsolationLimits& limits, const TextSink& told);

}  // namespace etalon
