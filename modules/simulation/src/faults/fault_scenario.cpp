#include "etalon/simulation/faults/fault_scenario.h"

#include <algorithm>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/ini_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"

namespace etalon {

namespace {

constexpr const char* kSection = "faults";

template <typename T>
FaultKind kindOf() {
  T fault;
  ParameterSet parameters(T::kName);
  fault.declare(parameters);
  return {T::kName, parameters.describe(), T::needs()};
}

template <typename... Ts>
std::vector<FaultKind> kindsOf(const std::variant<Ts...>*) {
  return {kindOf<Ts>()...};
}

/** The text of one fault: its kind and `key=value`s. */
struct FaultText {
  std::string kind, section;
  std::string whole;  ///< single blanks between its words
  IniFile values;     ///< in `section`
};

template <typename T>
bool readAs(const FaultText& text, std::vector<Fault>* faults) {
  if (text.kind != T::kName) return false;
  T fault;
  ParameterSet parameters(text.section);
  fault.declare(parameters);
  parameters.read(text.values);
  faults->push_back(fault);
  return true;
}

/** Makes the struct of the kind; false if there is none such. */
template <typename... Ts>
bool readAsAny(const FaultText& text, std::vector<Fault>* faults, const std::variant<Ts...>*) {
  return (readAs<Ts>(text, faults) || ...);
}

[[noreturn]] void fail(const std::string& origin, const std::string& name,
                       const std::string& message) {
  throw ConfigError(origin + ": " + (name.empty() ? "" : "[faults] " + name + ": ") + message);
}

FaultText readWords(const std::string& name, const std::string& piece, const std::string& origin) {
  std::istringstream words(piece);
  FaultText text;
  words >> text.kind;
  std::vector<std::string> names;
  for (const FaultKind& kind : faultKinds()) names.push_back(kind.name);
  if (std::find(names.begin(), names.end(), text.kind) == names.end()) {
    const std::string nearest = nearestWord(text.kind, names);
    fail(origin, name,
         "'" + printable(text.kind) + "': expected a fault, one of " + joined(names) +
             (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
  }
  text.section = (name.empty() ? "" : name + ".") + text.kind;
  text.whole = text.kind;
  for (std::string word; words >> word;) {
    text.whole += ' ' + word;
    const size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == word.size())
      fail(origin, name,
           text.kind + ": '" + printable(word) +
               "': expected key=value without blanks; a comma stands between faults");
    const std::string key = word.substr(0, equals);
    if (text.values.section(text.section).count(key) > 0)
      fail(origin, name, text.kind + ": '" + printable(word) + "': expected each key once");
    text.values.set(text.section, key, word.substr(equals + 1), origin);
  }
  return text;
}

void checkNeeds(const FaultText& text, const std::string& name, const std::string& origin) {
  for (const FaultKind& kind : faultKinds()) {
    if (kind.name != text.kind || kind.needs.empty()) continue;
    const auto& given = text.values.section(text.section);
    if (std::none_of(kind.needs.begin(), kind.needs.end(),
                     [&](const std::string& key) { return given.count(key) > 0; }))
      fail(origin, name, text.kind + ": expected " + joined(kind.needs, "=, or ") + "=");
  }
}

/** The line of "file:line"; values of a section are sorted by name. */
int lineOf(const std::string& origin) { return std::stoi(origin.substr(origin.rfind(':') + 1)); }

}  // namespace

std::vector<FaultKind> faultKinds() { return kindsOf(static_cast<const Fault*>(nullptr)); }

FaultScenario parseFaultScenario(const std::string& name, const std::string& text,
                                 const std::string& origin) {
  FaultScenario scenario{name, text, {}, {}};
  if (text.find_first_not_of(" \t") == std::string::npos) return scenario;
  std::istringstream pieces(text + ',');
  for (std::string piece; std::getline(pieces, piece, ',');) {
    const FaultText fault = readWords(name, piece, origin);
    readAsAny(fault, &scenario.faults, static_cast<const Fault*>(nullptr));
    checkNeeds(fault, name, origin);
    scenario.fault_texts.push_back(fault.whole);
  }
  return scenario;
}

std::vector<FaultScenario> readFaultFile(const std::string& path) {
  const IniFile ini = IniFile::fromFile(path);
  checkSections(ini, {kSection});
  std::vector<std::pair<int, FaultScenario>> in_file;
  for (const auto& [name, value] : ini.section(kSection))
    in_file.emplace_back(lineOf(value.origin), parseFaultScenario(name, value.text, value.origin));
  if (in_file.empty())
    throw ConfigError(path + ": expected a section [faults] with lines `name = fault, ...`");
  std::sort(in_file.begin(), in_file.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FaultScenario> scenarios;
  for (auto& [line, scenario] : in_file) scenarios.push_back(std::move(scenario));
  return scenarios;
}

}  // namespace etalon
