#include "support/stop_on_signals.h"

#include <csignal>

namespace etalon::app {

namespace {

std::atomic<bool> stop_requested{false};

extern "C" void requestStop(int signal_number) {
  stop_requested = true;
  std::signal(signal_number, SIG_DFL);
}

}  // namespace

const std::atomic<bool>* stopOnSignals() {
  std::signal(SIGINT, requestStop);
  std::signal(SIGTERM, requestStop);
  return &stop_requested;
}

}  // namespace etalon::app
