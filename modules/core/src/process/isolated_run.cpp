#include "etalon/core/process/isolated_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/process/child_process.h"
#include "etalon/core/text.h"

namespace etalon {

namespace {

/** What the child sends: a head, then `size` bytes. */
enum class Message : std::uint64_t { kTold, kReturned, kThrew };
struct MessageHead {
  Message type = Message::kTold;
  std::uint64_t size = 0;
};

bool sendMessage(int file, Message type, const std::string& text) {
  const MessageHead head{type, text.size()};
  return writeWhole(file, &head, sizeof head) && writeWhole(file, text.data(), text.size());
}

/** Reads `size` bytes; fewer if the other side ends before. */
std::string readBytes(int file, size_t size) {
  std::string bytes(size, '\0');
  size_t done = 0;
  while (done < size) {
    const ssize_t n = read(file, &bytes[done], size - done);
    if (n == 0 || (n < 0 && errno != EINTR)) break;
    if (n > 0) done += static_cast<size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

/** The next message; nothing if none comes whole. */
std::optional<std::pair<Message, std::string>> receive(int file) {
  MessageHead head;
  const std::string bytes = readBytes(file, sizeof head);
  if (bytes.size() != sizeof head) return std::nullopt;
  std::memcpy(&head, bytes.data(), sizeof head);
  std::string text = readBytes(file, head.size);
  if (text.size() != head.size) return std::nullopt;
  return std::make_pair(head.type, std::move(text));
}

void setLimit(int resource, rlim_t soft, rlim_t hard) {
  const rlimit limit{soft, hard};
  setrlimit(static_cast<__rlimit_resource>(resource), &limit);
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

using TellingFunction = std::function<std::string(const TextSink& tell)>;

[[noreturn]] void runChild(const TellingFunction& function, const IsolationLimits& limits, int file,
                           pid_t parent) {
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
  const TextSink tell = [file](const std::string& text) {
    if (!sendMessage(file, Message::kTold, text)) _exit(1);  // nobody listens
  };
  Message end = Message::kReturned;
  std::string answer;
  try {
    answer = function(tell);
  } catch (const std::exception& e) {
    end = Message::kThrew;
    answer = e.what();
  } catch (...) {
    end = Message::kThrew;
    answer = "something that is no std::exception";
  }
  std::fflush(nullptr);
  _exit(sendMessage(file, end, answer) ? 0 : 1);
}

std::string secondsText(double seconds) { return format("%.0f s", std::ceil(seconds)); }

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

/** A child process and the pipe from it. The destructor ends the child. */
class Child {
 public:
  Child(const TellingFunction& function, const IsolationLimits& limits) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
      throw Error(std::string("no pipe to a child process: ") + std::strerror(errno));
    std::fflush(nullptr);  // or the child would write the parent's text once more
    const pid_t parent = getpid();
    process_ = fork();
    const std::string reason = process_ < 0 ? std::strerror(errno) : "";
    if (process_ == 0) {
      close(ends[0]);
      runChild(function, limits, ends[1], parent);
    }
    file_ = ends[0];
    close(ends[1]);
    if (process_ > 0) return;
    close(file_);
    throw Error("no child process: " + reason);
  }
  ~Child() {
    close(file_);
    if (process_ < 0) return;
    kill(process_, SIGKILL);
    wait();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  int file() const { return file_; }

  /** Waits for its end; returns what waitpid() gives. */
  int wait() {
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return status;
  }

 private:
  pid_t process_ = -1;
  int file_ = -1;
};

}  // namespace

IsolatedOutcome runIsolated(const TellingFunction& function, const IsolationLimits& limits,
                            const TextSink& told) {
  Child child(function, limits);
  std::optional<std::pair<Message, std::string>> message = receive(child.file());
  for (; message && message->first == Message::kTold; message = receive(child.file()))
    told(message->second);
  const int status = child.wait();
  IsolatedOutcome outcome;
  const bool whole = message && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (whole && message->first == Message::kReturned) {
    outcome.completed = true;
    outcome.output = std::move(message->second);
  } else if (whole) {
    outcome.failure = "threw: " + message->second;
  } else {
    outcome.failure = describeEnd(status, limits);
    outcome.out_of_time =
        WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM);
  }
  return outcome;
}

IsolatedOutcome runIsolated(const std::function<std::string()>& function,
                            const IsolationLimits& limits) {
  return runIsolated([&](const TextSink&) { return function(); }, limits,
                     [](const std::string&) {});
}

}  // namespace etalon
