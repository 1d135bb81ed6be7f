#include "etalon/core/text.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace etalon {

std::string format(const char* text, ...) {
  char buffer[600];  // of most texts
  va_list arguments, again;
  va_start(arguments, text);
  va_copy(again, arguments);
  const size_t length = std::max(0, std::vsnprintf(buffer, sizeof buffer, text, arguments));
  std::string formatted(buffer, std::min(length, sizeof buffer - 1));
  if (length >= sizeof buffer) {
    formatted.resize(length);
    std::vsnprintf(formatted.data(), length + 1, text, again);
  }
  va_end(again);
  va_end(arguments);
  return formatted;
}

std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string csvNumber(double value) {
  if (std::isnan(value)) return "";
  return format("%.9g", value);
}

std::string markdownText(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

std::string latexText(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\')
      escaped += "\\textbackslash{}";
    else if (c == '~')
      escaped += "\\textasciitilde{}";
    else if (c == '^')
      escaped += "\\textasciicircum{}";
    else if (std::string("&%$#_{}").find(c) != std::string::npos)
      escaped += std::string("\\") + c;
    else
      escaped += c;
  }
  return escaped;
}

std::string htmlText(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&')
      escaped += "&amp;";
    else if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '"')
      escaped += "&quot;";
    else
      escaped += c;
  }
  return escaped;
}

std::string counted(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : between).append(word);
  return text;
}

std::string withoutFigures(const std::string& text) {
  std::string result;
  bool quoted = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto isDigit = [&text](size_t k) {
      return k < text.size() && std::isdigit(static_cast<unsigned char>(text[k])) != 0;
    };
    if (text[i] == '\'') quoted = !quoted;
    if (!quoted && !isDigit(i) && !(text[i] == '.' && isDigit(i + 1)))
      result += text[i];
    else if (result.empty() || result.back() != '#')
      result += '#';
  }
  return result;
}

std::size_t displayWidth(const std::string& text) {
  return std::count_if(text.begin(), text.end(),
                       [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
}

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::size_t own = displayWidth(text);
  const std::string space(width > own ? width - own : 0, ' ');
  return right ? space + text : text + space;
}

}  // namespace etalon
