#pragma once

#include <string>
#include <vector>

namespace etalon::app {

/**
 * Runs `etalon` with the words behind its name, and flushes what it prints. Throws nothing. It changes what the process does when
 * memory runs out or a signal comes, so a process calls it once.
 * @return the exit code
 */
int runCommandLine(const std::vector<std::string>& arguments);

}  // namespace etalon::app
