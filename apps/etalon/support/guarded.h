#pragma once

#include <functional>

namespace etalon::app {

/** Runs a command; what it throws becomes a sentence on stderr and an exit code. */
int guarded(const std::function<int()>& command);

/** Where a want of memory cannot be caught (in a thread, in a destructor), the program ends with
 * the same sentence and exit code. */
void sayWantOfMemory();

}  // namespace etalon::app
