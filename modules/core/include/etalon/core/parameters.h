#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "etalon/core/ini_file.h"

namespace etalon {

/** Inclusive range of a numeric parameter. */
template <typename T>
struct Range {
  T min = std::numeric_limits<T>::lowest();
  T max = std::numeric_limits<T>::max();
};

/**
 * The parameters of one INI section, declared once: key, variable, range, documentation. From the
 * same declaration come strict reading, the effective configuration, the documentation and a ready
 * INI section.
 *
 * A struct of options offers `void declare(ParameterSet&)`; the values that its members have at
 * that moment are the defaults. The variables must outlive the set.
 */
class ParameterSet {
 public:
  explicit ParameterSet(std::string section) : section_(std::move(section)) {}

  void add(const std::string& key, double* value, Range<double> range, const std::string& doc);
  void add(const std::string& key, int* value, Range<int> range, const std::string& doc);
  void add(const std::string& key, bool* value, const std::string& doc);
  void add(const std::string& key, std::string* value, const std::string& doc);
  /** A string that must be one of `choices`, such as the names of a table. */
  void add(const std::string& key, std::string* value, const std::vector<std::string>& choices,
           const std::string& doc);
  /** An enum, or a bool, by the names that the INI has for its values. */
  template <typename T, typename = std::enable_if_t<std::is_enum_v<T> || std::is_same_v<T, bool>>>
  void add(const std::string& key, T* value, const std::vector<std::pair<std::string, T>>& choices,
           const std::string& doc) {
    std::vector<std::string> names;
    for (const auto& choice : choices) names.push_back(choice.first);
    addChoice(
        key, names, doc, [value, choices](std::size_t i) { *value = choices[i].second; },
        [value, choices] {
          for (std::size_t i = 0; i < choices.size(); ++i)
            if (choices[i].second == *value) return i;
          return choices.size();
        });
  }

  /**
   * Sets every variable that the section of `ini` names. Throws ConfigError with file, line,
   * section, key, value, what was expected, and for an unknown key the nearest known one.
   */
  void read(const IniFile& ini) const;

  /** The section as INI text: documentation as comments, current values. */
  std::string toIni() const;

  struct Description {
    std::string key, type, default_value, range, doc;
  };
  std::vector<Description> describe() const;

  const std::string& section() const { return section_; }

 private:
  struct Entry {
    Description description;
    std::function<void(const IniFile&, const IniFile::Value&)> parse;
    std::function<std::string()> print;
  };
  void insert(Entry entry);
  /** @param set by the index of a name; @param get the index, names.size() if it has no name */
  void addChoice(const std::string& key, const std::vector<std::string>& names,
                 const std::string& doc, const std::function<void(std::size_t)>& set,
                 const std::function<std::size_t()>& get);

  std::string section_;
  std::vector<Entry> entries_;
};

/** Throws ConfigError if `ini` has a section that is not in `known`, naming the nearest known one.
 */
void checkSections(const IniFile& ini, const std::vector<std::string>& known);

/** The element of `candidates` nearest to `word` in edit distance; empty if none is near enough to
 * be meant. */
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace etalon
