#include "etalon/core/parameters.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <type_traits>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon {

namespace {

constexpr size_t kWrapColumn = 100;

/** Shortest text that reads back as the same number, independent of the locale. */
template <typename T>
std::string numberText(T value) {
  std::array<char, 64> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return std::string(buffer.data(), result.ptr);
}

std::string boolText(bool value) { return value ? "true" : "false"; }

/** Parses the whole of `text`; a leading '+' is allowed, hexadecimal, NaN and infinity are not. */
template <typename T>
bool parseWhole(const std::string& text, T* value) {
  const size_t start = text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0;
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data() + start, end, *value);
  if (result.ec != std::errc() || result.ptr != end) return false;
  if constexpr (std::is_floating_point_v<T>) return std::isfinite(*value);
  return true;
}

bool parseBool(const std::string& text, bool* value) {
  std::string lower = text;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  const bool is_true = lower == "true" || lower == "yes" || lower == "on" || lower == "1";
  *value = is_true;
  return is_true || lower == "false" || lower == "no" || lower == "off" || lower == "0";
}

template <typename T>
std::string rangeText(const Range<T>& range) {
  const bool has_min = range.min > std::numeric_limits<T>::lowest();
  const bool has_max = range.max < std::numeric_limits<T>::max();
  if (has_min && has_max) return numberText(range.min) + " to " + numberText(range.max);
  if (has_min) return "at least " + numberText(range.min);
  if (has_max) return "at most " + numberText(range.max);
  return "";
}

[[noreturn]] void failValue(const IniFile::Value& value, const std::string& section,
                            const std::string& key, const std::string& expected) {
  const size_t comment = value.text.find_first_of(";#");
  throw ConfigError(value.origin + ": [" + section + "] " + key + " = '" + value.text +
                    "': expected " + expected +
                    (comment == std::string::npos || comment == 0
                         ? ""
                         : "; a comment after a value begins with ' //', one with '" +
                               value.text.substr(comment, 1) + "' needs a line of its own"));
}

/** Throws if the declaration itself is wrong, which is a mistake in the code of a plugin or a
 * module. */
[[noreturn]] void failDeclaration(const std::string& section, const std::string& key,
                                  const std::string& message) {
  throw ConfigError("declaration of parameter [" + section + "] " + key + ": " + message);
}

template <typename T>
void checkDefault(const std::string& section, const std::string& key, T value,
                  const Range<T>& range) {
  // Written so that NaN fails.
  if (!(value >= range.min && value <= range.max)) {
    failDeclaration(section, key,
                    "default " + numberText(value) + " is outside its range " + rangeText(range));
  }
}

/** `text` as comment lines "; ...", broken at blanks so that no line passes kWrapColumn where
 * avoidable. */
std::string wrappedComment(const std::string& text) {
  std::istringstream words(text);
  std::string result, line = ";";
  for (std::string word; words >> word;) {
    if (line.size() > 1 && line.size() + 1 + word.size() > kWrapColumn) {
      result += line + "\n";
      line = ";";
    }
    line += " " + word;
  }
  return result + line + "\n";
}

/** Edits (insert, delete, replace, swap of neighbours) that turn `a` into `b`. */
size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      const size_t replace = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

/** The only candidate that begins with `word`, give or take one edit; empty if there is none or
 * more than one. */
std::string continuationOf(const std::string& word, const std::vector<std::string>& candidates) {
  constexpr size_t kShortest = 4;  // fewer letters begin too many words
  std::string found;
  for (const std::string& candidate : candidates) {
    if (word.size() < kShortest || candidate.size() <= word.size()) continue;
    if (editDistance(word, candidate.substr(0, word.size())) > 1) continue;
    if (!found.empty()) return "";
    found = candidate;
  }
  return found;
}

std::string didYouMean(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest = nearestWord(word, known);
  if (nearest.empty()) nearest = continuationOf(word, known);
  if (!nearest.empty()) return " (did you mean '" + nearest + "'?)";
  return known.empty() ? "" : " (known: " + joined(known) + ")";
}

}  // namespace

void ParameterSet::add(const std::string& key, double* value, Range<double> range,
                       const std::string& doc) {
  checkDefault(section_, key, *value, range);
  const std::string limits = rangeText(range);
  const std::string expected = "a finite number" + (limits.empty() ? "" : ", " + limits);
  insert({{key, "number", numberText(*value), limits, doc},
          [=, section = section_](const IniFile&, const IniFile::Value& text) {
            double parsed = 0.0;
            if (!parseWhole(text.text, &parsed) || parsed < range.min || parsed > range.max) {
              failValue(text, section, key, expected);
            }
            *value = parsed;
          },
          [value] { return numberText(*value); }});
}

void ParameterSet::add(const std::string& key, int* value, Range<int> range,
                       const std::string& doc) {
  checkDefault(section_, key, *value, range);
  const std::string limits = rangeText(range);
  const std::string expected = "an integer" + (limits.empty() ? "" : ", " + limits);
  insert({{key, "integer", numberText(*value), limits, doc},
          [=, section = section_](const IniFile&, const IniFile::Value& text) {
            int parsed = 0;
            if (!parseWhole(text.text, &parsed) || parsed < range.min || parsed > range.max) {
              failValue(text, section, key, expected);
            }
            *value = parsed;
          },
          [value] { return numberText(*value); }});
}

void ParameterSet::add(const std::string& key, bool* value, const std::string& doc) {
  insert({{key, "boolean", boolText(*value), "true, false", doc},
          [=, section = section_](const IniFile&, const IniFile::Value& text) {
            bool parsed = false;
            if (!parseBool(text.text, &parsed)) {
              failValue(text, section, key, "true or false (or yes, no, on, off, 1, 0)");
            }
            *value = parsed;
          },
          [value] { return boolText(*value); }});
}

void ParameterSet::add(const std::string& key, std::string* value, const std::string& doc) {
  insert({{key, "text", *value, "", doc},
          [value](const IniFile&, const IniFile::Value& text) { *value = text.text; },
          [value] { return *value; }});
}

void ParameterSet::add(const std::string& key, std::string* value,
                       const std::vector<std::string>& choices, const std::string& doc) {
  addChoice(
      key, choices, doc, [=](size_t i) { *value = choices[i]; },
      [=] { return std::find(choices.begin(), choices.end(), *value) - choices.begin(); });
}

void ParameterSet::addChoice(const std::string& key, const std::vector<std::string>& names,
                             const std::string& doc, const std::function<void(size_t)>& set,
                             const std::function<size_t()>& get) {
  if (get() >= names.size())
    failDeclaration(section_, key, "its default is none of its choices " + joined(names));
  insert({{key, "choice", names[get()], joined(names), doc},
          [=, section = section_](const IniFile&, const IniFile::Value& text) {
            const auto found = std::find(names.begin(), names.end(), text.text);
            if (found == names.end()) {
              const std::string nearest = nearestWord(text.text, names);
              failValue(text, section, key,
                        "one of " + joined(names) +
                            (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
            }
            set(found - names.begin());
          },
          [=] { return names[get()]; }});
}

void ParameterSet::insert(Entry entry) {
  const std::string& key = entry.description.key;
  for (const Entry& other : entries_) {
    if (other.description.key == key) failDeclaration(section_, key, "declared twice");
  }
  entries_.push_back(std::move(entry));
}

void ParameterSet::read(const IniFile& ini) const {
  std::vector<std::string> known;
  for (const Entry& entry : entries_) known.push_back(entry.description.key);
  const auto& values = ini.section(section_);
  for (const auto& [key, value] : values) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      failValue(value, section_, key, "a known key" + didYouMean(key, known));
    }
  }
  for (const Entry& entry : entries_) {
    const auto found = values.find(entry.description.key);
    if (found != values.end()) entry.parse(ini, found->second);
  }
}

std::string ParameterSet::toIni() const {
  std::string text = "[" + section_ + "]\n";
  for (const Entry& entry : entries_) {
    const Description& d = entry.description;
    text += "\n" + wrappedComment(d.doc);
    std::string facts = d.type;
    if (!d.range.empty()) facts += " (" + d.range + ")";
    facts += ", default " + (d.default_value.empty() ? "empty" : d.default_value);
    text += wrappedComment(facts);
    const std::string value = entry.print();
    text += d.key + " =" + (value.empty() ? "" : " " + value) + "\n";
  }
  return text;
}

std::vector<ParameterSet::Description> ParameterSet::describe() const {
  std::vector<Description> descriptions;
  for (const Entry& entry : entries_) descriptions.push_back(entry.description);
  return descriptions;
}

void checkSections(const IniFile& ini, const std::vector<std::string>& known) {
  for (const std::string& section : ini.sections()) {
    if (std::find(known.begin(), known.end(), section) == known.end()) {
      throw ConfigError(ini.sectionOrigin(section) + ": [" + section +
                        "]: expected a known section" + didYouMean(section, known));
    }
  }
}

std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t least = std::numeric_limits<size_t>::max();
  for (const std::string& candidate : candidates) {
    const size_t distance = editDistance(word, candidate);
    // Two edits in five letters: a forgotten syllable is found, another word is not.
    const bool near_enough = 5 * distance <= 2 * std::max(word.size(), candidate.size());
    if (near_enough && distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace etalon
