#pragma once

#include <string>

namespace etalon {

/**
 * Text that somebody else wrote (a plugin, a file, a name of a file), fit for a terminal and for a
 * page: control characters, byte order marks, and what turns the direction of writing stand there
 * as escapes ("\x1b", "\n", "\ufeff"), so that they show and do nothing. Any other text, UTF-8 or
 * not, stays as it is.
 * @param lines whether line ends stay
 */
std::string printable(const std::string& text, bool lines = false);

/** The text without a byte order mark (UTF-8) at its beginning. */
std::string withoutByteOrderMark(const std::string& text);

}  // namespace etalon
