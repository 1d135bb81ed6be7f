#pragma once

#include <functional>
#include <string>
#include <vector>

#include "etalon/testing/temporary_folder.h"

namespace etalon::testing {

/** What a run of the executable left. */
struct CommandResult {
  int exit_code = -1;  ///< -1 if it was ended by a signal
  std::string out, err;
};

/** Runs a program with these arguments, no shell between, and waits for it. */
CommandResult runProgram(const std::string& program, const std::vector<std::string>& arguments);

/** Runs a function, whose value is the exit code, in a process of its own and waits for it. This process must have one thread. */
CommandResult runForked(const std::function<int()>& command);

/** Runs `etalon` with these arguments: the built program in the chain's tests, a fork of the test program that calls
 * runCommandLine() in those of the command line, which start it some 400 times. */
CommandResult runEtalon(const std::vector<std::string>& arguments);

}  // namespace etalon::testing
