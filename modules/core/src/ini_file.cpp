#include "etalon/core/ini_file.h"

#include <mrpt/config/CConfigFileMemory.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"

namespace etalon {

namespace {

/** One `key = value` line, found by the scan in this file before MRPT parses the text. */
struct ScannedLine {
  std::string section, key, value, origin;
};

std::string trimmed(const std::string& text) {
  constexpr char kBlank[] = " \t\r\f\v";
  const size_t first = text.find_first_not_of(kBlank);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/** MRPT ends a value at a "//" that follows a blank. */
std::string withoutTrailingComment(const std::string& value) {
  for (size_t i = value.find("//"); i != std::string::npos; i = value.find("//", i + 1)) {
    if (i == 0 || std::isspace(static_cast<unsigned char>(value[i - 1]))) {
      return trimmed(value.substr(0, i));
    }
  }
  return value;
}

bool isComment(const std::string& line) {
  return line.empty() || line[0] == ';' || line[0] == '#' || line.rfind("//", 0) == 0;
}

bool isName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '.';
  });
}

std::string inQuotes(const std::string& text) {
  return "'" + printable(text.substr(0, 60)) + (text.size() > 60 ? "...'" : "'");
}

[[noreturn]] void fail(const std::string& origin, const std::string& message) {
  throw ConfigError(origin + ": " + message);
}

std::string parseSectionLine(const std::string& line, const std::string& origin) {
  const size_t end = line.find(']');
  if (end == std::string::npos) {
    fail(origin, "section " + inQuotes(line) + " has no closing ']': expected [name]");
  }
  const std::string rest = trimmed(line.substr(end + 1));
  if (!isComment(rest)) {
    fail(origin, inQuotes(rest) + " after the section's ']': expected the end of the line");
  }
  std::string name = trimmed(line.substr(1, end - 1));
  if (!isName(name)) {
    fail(origin, "section name " + inQuotes(name) + ": expected letters, digits, '_', '-' or '.'");
  }
  return name;
}

ScannedLine parseKeyLine(const std::string& line, const std::string& section,
                         const std::string& origin) {
  const size_t equals = line.find('=');
  if (equals == std::string::npos) {
    fail(origin, inQuotes(line) + ": expected a [section], `key = value` or a comment (;, #, //)");
  }
  const std::string key = trimmed(line.substr(0, equals));
  if (!isName(key)) {
    fail(origin, "key " + inQuotes(key) + ": expected letters, digits, '_', '-' or '.'");
  }
  if (section.empty()) {
    fail(origin,
         "key " + inQuotes(key) + " stands before the first section: expected [name] above");
  }
  return {section, key, withoutTrailingComment(trimmed(line.substr(equals + 1))), origin};
}

/** MRPT's reading of the same text; it expands variables, and joins lines that end with a
 * backslash. */
void checkAgainstMrpt(const std::string& text, const std::vector<ScannedLine>& lines,
                      const std::string& name) {
  mrpt::config::CConfigFileMemory mrpt_file;
  try {
    mrpt_file.setContent(text);
    for (const ScannedLine& line : lines) {
      const std::string value = trimmed(mrpt_file.read_string(line.section, line.key, "", false));
      if (value != line.value) {
        fail(line.origin, "[" + line.section + "] " + line.key + " = " + inQuotes(line.value) +
                              ": expected a plain value (MRPT's parser would read " +
                              inQuotes(value) + "; variables and line continuations are refused)");
      }
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    fail(name, std::string("MRPT's parser refuses the file: ") + e.what());
  }
}

}  // namespace

IniFile IniFile::fromFile(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) fail(path, "no such file: expected an INI file");
  if (std::filesystem::is_directory(path, error)) fail(path, "is a folder: expected an INI file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path, "cannot be opened for reading: expected an INI file");
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) fail(path, "cannot be read to its end");
  return fromText(text, path);
}

IniFile IniFile::fromText(const std::string& text, const std::string& name) {
  IniFile ini;
  ini.name_ = name;
  if (text.find('\0') != std::string::npos) fail(name, "holds zero bytes: expected a text file");
  const std::string content = withoutByteOrderMark(text);

  std::istringstream stream(content);
  std::vector<ScannedLine> lines;
  std::map<std::string, std::string> seen;  // MRPT does not tell upper from lower case
  std::string raw, section;
  for (int number = 1; std::getline(stream, raw); ++number) {
    const std::string origin = name + ":" + std::to_string(number);
    const std::string line = trimmed(raw);
    if (isComment(line)) continue;
    if (line[0] == '[') {
      section = parseSectionLine(line, origin);
      ini.section_origin_.emplace(section, origin);
      ini.values_[section];
      continue;
    }
    const ScannedLine scanned = parseKeyLine(line, section, origin);
    const auto [first, is_new] =
        seen.emplace(lowerCase(section) + "\n" + lowerCase(scanned.key), origin);
    if (!is_new) {
      fail(origin, "[" + section + "] " + scanned.key + " = " + inQuotes(scanned.value) +
                       ": expected each key once; it already stands at " + first->second);
    }
    ini.values_[section][scanned.key] = {scanned.value, origin};
    lines.push_back(scanned);
  }
  checkAgainstMrpt(content, lines, name);
  return ini;
}

void IniFile::set(const std::string& section, const std::string& key, const std::string& value,
                  const std::string& origin) {
  if (!isName(section) || !isName(key)) {
    fail(origin, inQuotes(section + "." + key) +
                     ": expected section.key of letters, digits, '_', '-' or '.'");
  }
  const std::string plain = trimmed(value);
  // What is set here can be written to a file and read back, so it is parsed as if it came from
  // one.
  if (plain.find_first_of(std::string("\n\r\0", 3)) != std::string::npos ||
      withoutTrailingComment(plain) != plain) {
    fail(origin, "[" + section + "] " + key + " = " + inQuotes(plain) +
                     ": expected one line without ' //', which starts a comment");
  }
  checkAgainstMrpt("[" + section + "]\n" + key + " = " + plain + "\n",
                   {{section, key, plain, origin}}, origin);
  section_origin_.emplace(section, origin);
  values_[section][key] = {plain, origin};
}

void IniFile::add(const IniFile& later) {
  for (const auto& [section, origin] : later.section_origin_)
    section_origin_.emplace(section, origin);
  for (const auto& [section, values] : later.values_) {
    std::map<std::string, Value>& own = values_[section];
    for (const auto& [key, value] : values) own[key] = value;
  }
}

void IniFile::setFromArgument(const std::string& argument) {
  const size_t equals = argument.find('=');
  const size_t dot = argument.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals) {
    fail("--set", inQuotes(argument) + ": expected section.key=value");
  }
  const std::string section = trimmed(argument.substr(0, dot));
  const std::string key = trimmed(argument.substr(dot + 1, equals - dot - 1));
  if (section.empty() || key.empty()) {
    fail("--set", inQuotes(argument) + ": expected section.key=value");
  }
  set(section, key, argument.substr(equals + 1), "--set");
}

std::vector<std::string> IniFile::sections() const {
  std::vector<std::string> names;
  for (const auto& [name, values] : values_) names.push_back(name);
  return names;
}

const std::map<std::string, IniFile::Value>& IniFile::section(const std::string& name) const {
  static const std::map<std::string, Value> kNone;
  const auto found = values_.find(name);
  return found == values_.end() ? kNone : found->second;
}

std::string IniFile::sectionOrigin(const std::string& name) const {
  const auto found = section_origin_.find(name);
  return found == section_origin_.end() ? name_ : found->second;
}

}  // namespace etalon
