#include "etalon/core/process/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

namespace etalon {
namespace {

using ::testing::HasSubstr;

/** A child process that does `work`; ended and waited for at the end of its life. */
class Child {
 public:
  explicit Child(const std::function<void()>& work) : process_(fork()) {
    if (process_ != 0) return;
    work();
    _exit(0);
  }
  ~Child() {
    if (!waited_) kill(process_, SIGKILL);
    if (!waited_) status();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t process() const { return process_; }
  int status() {
    int status = 0;
    waitpid(process_, &status, 0);
    waited_ = true;
    return status;
  }

 private:
  pid_t process_;
  bool waited_ = false;
};

/** Looks at the child until the watch wants it ended. */
std::string whyEnded(const Child& child, double limit_s) {
  ProcessWatch watch(child.process(), limit_s);
  for (int i = 0; i < 1000; ++i) {
    usleep(static_cast<useconds_t>(1e6 * watch.intervalS()));
    if (const std::string why = watch.look(); !why.empty()) return why;
  }
  return "never";
}

TEST(ChildProcess, SaysHowItEnded) {
  Child crashes([] { std::signal(SIGABRT, SIG_DFL), raise(SIGABRT); });
  EXPECT_EQ(describeProcessEnd(crashes.status()), "crashed with signal 6 (Aborted)");
  Child exits([] { _exit(0); });
  EXPECT_EQ(describeProcessEnd(exits.status()), "ended the process with exit code 0");
}

TEST(ChildProcess, TheWatchEndsALoop) {
  const Child loops([] {
    for (volatile int i = 0;; i = i + 1) {
    }
  });
  EXPECT_THAT(whyEnded(loops, 0.1), HasSubstr("used more than 0.1 s of processor time"));
}

TEST(ChildProcess, TheWatchEndsWhatWaits) {
  const Child waits([] {
    for (;;) pause();
  });
  EXPECT_THAT(whyEnded(waits, 0.1), HasSubstr("waited for 0.1 s without using the processor"));
}

}  // namespace
}  // namespace etalon
