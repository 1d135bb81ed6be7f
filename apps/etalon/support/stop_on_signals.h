#pragma once

#include <atomic>
#include <string>

namespace etalon::app {

/** Lets the first Ctrl-C (or SIGTERM) set what is returned, and the second one end the program. */
const std::atomic<bool>* stopOnSignals();

/**
 * Lets Ctrl-C (or SIGTERM) end the program at once, with a sentence on stderr and kInterrupted. For
 * work whose results are written at its end. Child processes end without the sentence.
 * @param sentence "check-plugin: interrupted"
 */
void endOnSignals(const std::string& sentence);

}  // namespace etalon::app
