#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace etalon {

/** printf into a string; cut after 600 characters. */
__attribute__((format(printf, 1, 2))) std::string format(const char* text, ...);

/** RFC 4180: quoted where it must be. */
std::string csvField(const std::string& text);

/** `%.9g`; empty for NaN. */
std::string csvNumber(double value);

/** A bar would end a Markdown cell. */
std::string markdownText(const std::string& text);

/** LaTeX's special characters as themselves. */
std::string latexText(const std::string& text);

/** HTML's special characters as themselves, in text and in attributes. */
std::string htmlText(const std::string& text);

/** One word after the other. */
std::string joined(const std::vector<std::string>& words, const std::string& between = ", ");

/** Characters of UTF-8 text: bytes that do not continue one. */
std::size_t displayWidth(const std::string& text);

/** Filled with spaces to `width` characters. */
std::string padded(const std::string& text, std::size_t width, bool right);

}  // namespace etalon
