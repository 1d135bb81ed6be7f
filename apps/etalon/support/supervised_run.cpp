#include "support/supervised_run.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "etalon/core/errors.h"
#include "etalon/core/process/child_process.h"
#include "support/guarded.h"

namespace etalon::app {

namespace {

class WatchedInitializer : public Initializer {
  DEFINE_MRPT_OBJECT(WatchedInitializer, etalon::app)

 public:
  WatchedInitializer() = default;
  WatchedInitializer(std::shared_ptr<const Initializer> initializer, std::string name,
                     RunState* state)
      : initializer_(std::move(initializer)), name_(std::move(name)), state_(state) {}

  void declareParameters(ParameterSet& /*parameters*/) override {}  // the plugin has its own
  bool needsVisualSolution() const override { return initializer_->needsVisualSolution(); }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    std::snprintf(state_->initializer, sizeof state_->initializer, "%s", name_.c_str());
    state_->attempt_t = problem.keyframe(problem.keyframeCount() - 1).t;
    ++state_->attempts;
    state_->in_attempt = true;
    InitializationResult result = initializer_->initialize(problem);  // throws nothing
    state_->in_attempt = false;
    return result;
  }

 private:
  std::shared_ptr<const Initializer> initializer_;
  std::string name_;
  RunState* state_ = nullptr;
};

IMPLEMENTS_MRPT_OBJECT(WatchedInitializer, etalon::Initializer, etalon::app)

[[noreturn]] void failToStart() {
  throw Error(std::string("no process can be started: ") + std::strerror(errno));
}

/** A RunState in memory that child processes share. */
class SharedState {
 public:
  SharedState()
      : memory_(mmap(nullptr, sizeof(RunState), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                     -1, 0)) {
    if (memory_ == MAP_FAILED) failToStart();
    state_ = new (memory_) RunState();
  }
  ~SharedState() { munmap(memory_, sizeof(RunState)); }
  SharedState(const SharedState&) = delete;
  SharedState& operator=(const SharedState&) = delete;

  RunState& operator*() const { return *state_; }
  RunState* operator->() const { return state_; }

 private:
  void* memory_;
  RunState* state_ = nullptr;
};

/** Waits for the child's end, and kills it where an initializer's call takes too long. Returns the
 * reason for killing it, if any. `alive` is a pipe that the child holds open. */
std::string superviseUntilEnd(pid_t child, int alive, double limit_s, const std::atomic<bool>* stop,
                              RunState* shared, int* status) {
  RunState& state = *shared;
  ProcessWatch watch(child, limit_s);
  std::uint64_t attempt = 0;
  std::string why_killed;
  for (;;) {
    pollfd news{alive, POLLIN, 0};
    const bool ended = poll(&news, 1, static_cast<int>(1e3 * watch.intervalS())) > 0;
    const pid_t waited = waitpid(child, status, ended ? 0 : WNOHANG);
    if (waited == child || (waited < 0 && errno != EINTR)) return why_killed;
    if (stop && stop->load()) state.stop = true;
    if (!state.in_attempt || !why_killed.empty()) continue;
    if (attempt != state.attempts) {
      attempt = state.attempts;
      watch.restart();
      continue;
    }
    why_killed = watch.look();
    if (!why_killed.empty()) kill(child, SIGKILL);
  }
}

}  // namespace

std::shared_ptr<const Initializer> watched(std::shared_ptr<const Initializer> initializer,
                                           const std::string& name, RunState* state) {
  return std::make_shared<WatchedInitializer>(std::move(initializer), name, state);
}

RunEnd runSupervised(double limit_s, const std::function<int(RunState& state)>& run,
                     const std::atomic<bool>* stop) {
  const SharedState state;
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) failToStart();
  std::fflush(nullptr);  // or the child would write this process's text again
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) failToStart();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    close(ends[0]);
    if (stop) {  // a terminal sends Ctrl-C to both processes
      std::signal(SIGINT, SIG_IGN);
      std::signal(SIGTERM, SIG_IGN);
    }
    const int exit_code = withOutputWritten(guarded([&] { return run(*state); }));
    state->finished = true;
    std::exit(exit_code);
  }
  close(ends[1]);
  int status = 0;
  RunEnd end;
  const std::string why_killed = superviseUntilEnd(child, ends[0], limit_s, stop, &*state, &status);
  close(ends[0]);
  end.out_of_time = !why_killed.empty();
  end.finished = state->finished && WIFEXITED(status);
  end.exit_code = end.finished ? WEXITSTATUS(status) : 0;
  if (!end.finished) end.how = end.out_of_time ? why_killed : describeProcessEnd(status);
  if (state->in_attempt) end.initializer = state->initializer;
  end.attempt_t = state->attempt_t;
  end.attempts = state->attempts;
  if (state->first_image >= 0) end.first_image = state->first_image;
  if (state->processed >= 0) end.processed = state->processed;
  return end;
}

}  // namespace etalon::app
