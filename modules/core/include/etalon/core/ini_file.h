#pragma once

#include <map>
#include <string>
#include <vector>

namespace etalon {

/**
 * An INI file, parsed strictly: the file must exist, every line must be a comment (';', '#' or '//'
 * on a line of its own, " //" also after a value), a section or `key = value`, and no key may stand
 * twice in a section (upper and lower case are the same for that). What MRPT's parser would change
 * is refused: it expands `$env{}` and `@define` and joins lines that end with a backslash.
 * Values keep the line that they came from.
 */
class IniFile {
 public:
  struct Value {
    std::string text;
    std::string origin;  ///< "file:line", or "--set" for an override
  };

  IniFile() = default;

  /** Throws ConfigError naming file and line. */
  static IniFile fromFile(const std::string& path);
  /** Like fromFile, from text; `name` stands for the file in messages. */
  static IniFile fromText(const std::string& text, const std::string& name);

  /** Adds or replaces a value; ConfigError if it could not stand in a file (line breaks, " //"). */
  void set(const std::string& section, const std::string& key, const std::string& value,
           const std::string& origin);
  /** Adds all values of another file, or replaces them where this one has them; they keep the line
   * that they came from. */
  void add(const IniFile& later);
  /** `section.key=value`, as on the command line. Throws ConfigError if it has another form. */
  void setFromArgument(const std::string& argument);

  const std::string& name() const { return name_; }
  std::vector<std::string> sections() const;
  /** Values of a section; empty if there is no such section. */
  const std::map<std::string, Value>& section(const std::string& name) const;
  /** Where a section starts, "file:line". */
  std::string sectionOrigin(const std::string& name) const;

 private:
  std::string name_;
  std::map<std::string, std::map<std::string, Value>> values_;
  std::map<std::string, std::string> section_origin_;
};

}  // namespace etalon
