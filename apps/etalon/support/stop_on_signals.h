#pragma once

#include <atomic>

namespace etalon::app {

/** Lets the first Ctrl-C (or SIGTERM) set what is returned, and the second one end the program. */
const std::atomic<bool>* stopOnSignals();

}  // namespace etalon::app
