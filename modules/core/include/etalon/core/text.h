#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace etalon {

/** printf into a string. */
__attribute__((format(printf, 1, 2))) std::string format(const char* text, ...);

/** RFC 4180: quoted where it must be. */
std::string csvField(const std::string& text);

/** `%.9g`; empty for NaN. */
std::string csvNumber(double value);

/** Escapes bars, which would end a Markdown cell. */
std::string markdownText(const std::string& text);

/** Escapes LaTeX's special characters. */
std::string latexText(const std::string& text);

/** Escapes HTML's special characters, in text and in attributes. */
std::string htmlText(const std::string& text);

/** The words with `between` between them. */
std::string joined(const std::vector<std::string>& words, const std::string& between = ", ");

/** "1 frame", "3 frames". */
std::string counted(std::size_t count, const std::string& noun);

/** The text with '#' for each number and for what is in single quotes: two messages that differ in
 * their figures alone become the same. */
std::string withoutFigures(const std::string& text);

/** Characters of UTF-8 text: bytes that do not continue one. */
std::size_t displayWidth(const std::string& text);

/** The text filled with spaces to `width` characters. */
std::string padded(const std::string& text, std::size_t width, bool right);

}  // namespace etalon
