#pragma once

#include <string>
#include <vector>

namespace etalon::app {

/**
 * What `etalon` does with the words behind its name: runs the command, prints, writes its output out. Throws nothing. Changes
 * what the process does when memory runs out or a signal comes, so it is called once in a process.
 * @return the exit code
 */
int runCommandLine(const std::vector<std::string>& arguments);

}  // namespace etalon::app
