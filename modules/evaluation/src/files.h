#pragma once

#include <string>

namespace etalon {

/** Makes a folder and those above it, where they are not there. @throws DataError if it cannot */
void makeFolder(const std::string& path);

/** Writes a file beside and then moves it there: never half of it. @throws DataError if it cannot
 */
void writeText(const std::string& path, const std::string& text);

}  // namespace etalon
