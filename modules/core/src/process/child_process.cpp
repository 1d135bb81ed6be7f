#include "etalon/core/process/child_process.h"

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "etalon/core/text.h"

namespace etalon {

std::string describeProcessEnd(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return "crashed with signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
  }
  return "ended the process with exit code " + std::to_string(WEXITSTATUS(status));
}

bool writeWhole(int file, const void* data, size_t size) {
  const char* const bytes = static_cast<const char*>(data);
  for (size_t done = 0; done < size;) {
    ssize_t n = send(file, bytes + done, size - done, MSG_NOSIGNAL);
    if (n < 0 && errno == ENOTSOCK) n = write(file, bytes + done, size - done);
    if (n < 0 && errno != EINTR) return false;
    if (n > 0) done += static_cast<size_t>(n);
  }
  return true;
}

ProcessWatch::ProcessWatch(pid_t process, double limit_s)
    : process_(process), limit_s_(limit_s), interval_s_(std::clamp(0.1 * limit_s, 0.01, 1.0)) {
  restart();
}

double ProcessWatch::processorTime() const {
  clockid_t clock = 0;
  timespec time{};
  if (clock_getcpuclockid(process_, &clock) != 0 || clock_gettime(clock, &time) != 0)
    return last_s_;  // it has ended
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void ProcessWatch::restart() {
  begin_s_ = last_s_ = processorTime();
  idle_looks_ = 0;
}

std::string ProcessWatch::look() {
  constexpr double kIdle = 1e-3;  // share of a processor; a loop that sleeps is idle, too
  const double now_s = processorTime();
  idle_looks_ = now_s - last_s_ < kIdle * interval_s_ ? idle_looks_ + 1 : 0;
  last_s_ = now_s;
  const std::string limit = format("%g s", limit_s_);
  if (now_s - begin_s_ > limit_s_)
    return std::string("used more than ") + limit + " of processor time";
  if (idle_looks_ * interval_s_ >= limit_s_)
    return std::string("waited for ") + limit + " without using the processor";
  return "";
}

}  // namespace etalon
