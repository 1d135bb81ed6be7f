#pragma once

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

/** The same with the built `etalon`. */
CommandResult runEtalon(const std::vector<std::string>& arguments);

}  // namespace etalon::testing
