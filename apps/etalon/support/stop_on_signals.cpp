#include "support/stop_on_signals.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

#include "commands.h"

namespace etalon::app {

namespace {

std::atomic<bool> stop_requested{false};

extern "C" void requestStop(int signal_number) {
  stop_requested = true;
  std::signal(signal_number, SIG_DFL);
}

// For endSaying(), which may call nothing that allocates.
pid_t process_to_end = 0;
char last_sentence[200] = "";

extern "C" void endSaying(int signal_number) {
  if (getpid() != process_to_end) {
    std::signal(signal_number, SIG_DFL);
    raise(signal_number);
    return;
  }
  // A terminal has the text of a progress line there.
  const char* text = isatty(STDERR_FILENO) == 1 ? last_sentence : last_sentence + 1;
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
  _exit(kInterrupted);
}

}  // namespace

const std::atomic<bool>* stopOnSignals() {
  std::signal(SIGINT, requestStop);
  std::signal(SIGTERM, requestStop);
  return &stop_requested;
}

void endOnSignals(const std::string& sentence) {
  process_to_end = getpid();
  std::snprintf(last_sentence, sizeof last_sentence, "\n%s\n", sentence.c_str());
  std::signal(SIGINT, endSaying);
  std::signal(SIGTERM, endSaying);
}

}  // namespace etalon::app
