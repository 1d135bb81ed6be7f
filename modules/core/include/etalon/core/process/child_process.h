#pragma once

#include <sys/types.h>

#include <string>

namespace etalon {

/** Limit of processor time that is far from what any initializer needs, s. */
constexpr double kDefaultTimeLimitS = 60.0;

/**
 * How a child process ended in the middle of its work, as the end of a sentence: "crashed with
 * signal 11 (Segmentation fault)", "ended the process with exit code 0".
 * @param status as waitpid() gives it
 */
std::string describeProcessEnd(int status);

/** Writes all bytes to a file descriptor; false if it cannot. Never raises SIGPIPE on a socket. */
bool writeWhole(int file, const void* data, size_t size);

/**
 * Watches that a child process does not compute longer than it may, or wait for ever. What counts
 * is its processor time; for one that waits, the number of looks at which it had used (nearly)
 * none. The clock on the wall decides nothing, so a busy or stopped machine ends no work.
 */
class ProcessWatch {
 public:
  /** @param limit_s processor time of one piece of work, s */
  ProcessWatch(pid_t process, double limit_s);

  /** A new piece of work begins. */
  void restart();
  /** To be called every intervalS(). Empty while all is well, else why the work has to be ended, as
   * the end of a sentence: "used more than 60 s of processor time". */
  std::string look();
  double intervalS() const { return interval_s_; }

 private:
  double processorTime() const;

  pid_t process_;
  double limit_s_, interval_s_;
  double begin_s_ = 0.0, last_s_ = 0.0;  ///< processor time at restart() and at the last look()
  int idle_looks_ = 0;
};

}  // namespace etalon
