#pragma once

#include <string>
#include <vector>

namespace etalon::app {

/** Says how many stereo pairs could not be read, if any, and prints the reader's warnings, which
 * name only the first of these pairs, on stderr. */
void printReadProblems(int unreadable_pairs, const std::vector<std::string>& warnings);

}  // namespace etalon::app
