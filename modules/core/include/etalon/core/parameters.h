#pragma once

#include <functional>
#include <limits>
#include <string>
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
  /** A string that must be one of `choices`. */
  void add(const std::string& key, std::string* value, const std::vector<std::string>& choices,
           const std::string& doc);

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
