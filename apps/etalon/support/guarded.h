#pragma once

#include <functional>

namespace etalon::app {

/** Runs a command and turns what it throws into a sentence on stderr and an exit code. */
int guarded(const std::function<int()>& command);

/** The exit code of a process that has done its work and now ends: `exit_code`, unless what it
 * printed could not be written. */
int withOutputWritten(int exit_code);

/** Makes the program end with the same sentence and exit code where running out of memory cannot be
 * caught (in a thread, in a destructor). */
void sayWantOfMemory();

}  // namespace etalon::app
