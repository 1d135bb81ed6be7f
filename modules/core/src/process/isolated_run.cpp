#include "etalon/core/process/isolated_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/core/process/child_process.h"

namespace etalon {

namespace {

// First byte of what the child writes.
constexpr char kReturned = 'r', kThrew = 't';

void setLimit(int resource, rlim_t soft, rlim_t hard) {
  const rlimit limit{soft, hard};
  setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

std::string readWhole(int file) {
  std::string text;
  char buffer[4096];
  while (true) {
    const ssize_t n = read(file, buffer, sizeof(buffer));
    if (n == 0 || (n < 0 && errno != EINTR)) return text;
    if (n > 0) text.append(buffer, n);
  }
}

#ifndef __SANITIZE_ADDRESS__
/** Bytes of addresses that this process has; 0 if /proc does not tell. */
rlim_t addressesInUse() {
  std::ifstream file("/proc/self/statm");
  rlim_t pages = 0;
  file >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}
#endif

[[noreturn]] void runChild(const std::function<std::string()>& function,
                           const IsolationLimits& limits, int file, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // it does not outlive its caller
  if (getppid() != parent) _exit(1);
  const auto cpu_s = static_cast<rlim_t>(std::ceil(limits.cpu_s));
  setLimit(RLIMIT_CPU, cpu_s, cpu_s + 1);
  setLimit(RLIMIT_CORE, 0, 0);
#ifndef __SANITIZE_ADDRESS__  // reserves terabytes of addresses
  const auto bytes = static_cast<rlim_t>(limits.memory_gib * 1024.0 * 1024.0 * 1024.0);
  const rlim_t limit = addressesInUse() + bytes;
  setLimit(RLIMIT_AS, limit, limit);
#endif
  std::signal(SIGALRM, SIG_DFL);
  alarm(static_cast<unsigned>(std::ceil(limits.clockSeconds())));
  dup2(STDERR_FILENO, STDOUT_FILENO);
  std::string answer;
  try {
    answer = kReturned + function();
  } catch (const std::exception& e) {
    answer = kThrew + std::string(e.what());
  } catch (...) {
    answer = std::string(1, kThrew) + "something that is no std::exception";
  }
  std::fflush(nullptr);
  _exit(writeWhole(file, answer.data(), answer.size()) ? 0 : 1);
}

std::string secondsText(double seconds) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.0f s", std::ceil(seconds));
  return text;
}

std::string describeEnd(int status, const IsolationLimits& limits) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU)
      return "used more than " + secondsText(limits.cpu_s) + " of processor time";
    if (signal == SIGKILL)
      return "was killed from outside, or by the limit of " + secondsText(limits.cpu_s) +
             " of processor time";
    if (signal == SIGALRM)
      return "did not end within " + secondsText(limits.clockSeconds()) + " on the clock";
  }
  return describeProcessEnd(status);
}

}  // namespace

IsolatedOutcome runIsolated(const std::function<std::string()>& function,
                            const IsolationLimits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw Error(std::string("no pipe to a child process: ") + std::strerror(errno));
  std::fflush(nullptr);  // or the child would write the parent's text once more
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    const std::string reason = std::strerror(errno);
    close(ends[0]);
    close(ends[1]);
    throw Error("no child process: " + reason);
  }
  if (child == 0) {
    close(ends[0]);
    runChild(function, limits, ends[1], parent);
  }
  close(ends[1]);
  const std::string answer = readWhole(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  IsolatedOutcome outcome;
  const bool whole = WIFEXITED(status) && WEXITSTATUS(status) == 0 && !answer.empty();
  if (whole && answer[0] == kReturned) {
    outcome.completed = true;
    outcome.output = answer.substr(1);
  } else if (whole && answer[0] == kThrew) {
    outcome.failure = "threw: " + answer.substr(1);
  } else {
    outcome.failure = describeEnd(status, limits);
    outcome.out_of_time =
        WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM);
  }
  return outcome;
}

}  // namespace etalon
