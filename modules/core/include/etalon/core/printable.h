#pragma once

#include <string>

namespace etalon {

/**
 * Text from outside (a plugin, a file, the name of a file), made safe for a terminal and a page:
 * control characters, byte order marks and marks that change the direction of writing become
 * escapes ("\x1b", "\n", "\ufeff"), so that they show and do nothing. Any other text, UTF-8 or
 * not, stays as it is.
 * @param lines whether line ends stay
 */
std::string printable(const std::string& text, bool lines = false);

/** The text without a byte order mark (UTF-8) at its beginning. */
std::string withoutByteOrderMark(const std::string& text);

}  // namespace etalon
