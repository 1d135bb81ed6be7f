#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace etalon {

/** JSON that is safe inside a <script> element: valid UTF-8, no '<'. */
std::string scriptText(const nlohmann::json& json);

/** The text with its line ends kept, all else as in printable(), and U+FFFD for invalid UTF-8. */
std::string pageText(const std::string& text);

/** pageText(), escaped for HTML. */
std::string escaped(const std::string& text);

/** Rounds to six digits, enough for every chart; null where there is no number. */
nlohmann::json rounded(double value);

/** `%g`. */
std::string number(double value);

template <typename Items, typename Text>
std::string joined(const Items& items, const std::string& separator, const Text& textOf) {
  std::string result;
  for (const auto& item : items) result += (result.empty() ? "" : separator) + textOf(item);
  return result;
}

/** A term of the summary's list; nothing without content. @param html is escaped already */
std::string term(const std::string& name, const std::string& html);

std::string versionsText(const std::map<std::string, std::string>& versions);

/**
 * A whole page: `page` with each {{name}} of `texts` replaced once, beside the style, the scripts,
 * the data and the licences, which every page has.
 * @param texts HTML, but for "title", which is escaped here
 */
std::string reportPage(std::string_view page, std::string_view script,
                       std::map<std::string, std::string> texts, const nlohmann::json& data);

}  // namespace etalon
