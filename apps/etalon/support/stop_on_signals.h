#pragma once

#include <atomic>
#include <string>

#include "etalon/core/errors.h"

namespace etalon::app {

/** Thrown where work was told to stop that leaves nothing behind. */
struct Interrupted : public Error {
  Interrupted() : Error("interrupted") {}
};

/** Lets the first Ctrl-C (or SIGTERM) set what is returned, and the second one end the program. */
const std::atomic<bool>* stopOnSignals();

/**
 * Lets Ctrl-C (or SIGTERM) end the program at once, with a sentence on stderr and kInterrupted. For
 * work whose results are written at its end. Child processes end without the sentence.
 * @param sentence "check-plugin: interrupted"
 */
void endOnSignals(const std::string& sentence);

}  // namespace etalon::app
