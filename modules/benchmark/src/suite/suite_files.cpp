#include "suite/suite_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"

namespace etalon {

namespace fs = std::filesystem;

std::string pathIn(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw DataError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
  return text.str();
}

nlohmann::json parseJson(const std::string& text, const std::string& path, int line) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    throw DataError(path, line, std::string("expected JSON: ") + e.what());
  }
}

std::string jsonText(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

namespace {

/** The first line in which two texts differ. */
std::string firstDifference(const std::string& a, const std::string& b) {
  size_t begin = 0;
  for (size_t i = 0; i <= std::min(a.size(), b.size()); ++i) {
    const bool end = i == a.size() || i == b.size();
    if (end || a[i] != b[i]) break;
    if (a[i] == '\n') begin = i + 1;
  }
  const auto line = [begin](const std::string& text) {
    return "'" + text.substr(begin, text.find('\n', begin) - begin) + "'";
  };
  return line(a) + " and " + line(b);
}

/** Versions in which two builds differ, and the beginnings of their hashes. */
std::string differenceOfPrograms(const SuiteRecord& a, const SuiteRecord& b) {
  std::string details;
  for (const auto& [name, version] : a.versions) {
    const auto other = b.versions.find(name);
    if (other != b.versions.end() && other->second != version)
      details.append(name).append(" ").append(version).append(" and ").append(other->second) +=
          ", ";
  }
  details += "hashes " + a.binaries.substr(0, 8) + "... and " + b.binaries.substr(0, 8) + "...";
  return "another build of etalon (" + details + ")";
}

std::string differenceOfInitializers(const std::vector<BenchmarkInitializer>& a,
                                     const std::vector<BenchmarkInitializer>& b) {
  if (a.size() != b.size()) return "other initializers";
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].name != b[i].name)
      return "other initializers ('" + a[i].name + "' and '" + b[i].name + "')";
    if (a[i].binary != b[i].binary) return "another build of the plugin '" + a[i].name + "'";
    if (a[i].config != b[i].config)
      return "another configuration of '" + a[i].name +
             "': " + firstDifference(a[i].config, b[i].config);
  }
  return "";
}

}  // namespace

std::string differenceOfSuites(const SuiteRecord& a, const SuiteRecord& b,
                               const std::string& of_protocols) {
  if (a.binaries != b.binaries) return differenceOfPrograms(a, b);
  if (a.config != b.config) return "another configuration: " + firstDifference(a.config, b.config);
  for (const std::string& difference :
       {of_protocols, differenceOfInitializers(a.initializers, b.initializers)})
    if (!difference.empty()) return difference;
  if (a.sequences.size() != b.sequences.size()) return "other recordings";
  for (size_t i = 0; i < a.sequences.size(); ++i) {
    const BenchmarkSequence& s = a.sequences[i];
    const BenchmarkSequence& t = b.sequences[i];
    if (s.name != t.name) return "other recordings ('" + s.name + "' and '" + t.name + "')";
    if (!s.content.empty() && !t.content.empty() && s.content != t.content)
      return "the recording '" + s.name + "' has other content";
    // The windows are divided over the recordings that could be opened.
    if ((a.shards > 1 || b.shards > 1) && (s.stereo_frames == 0) != (t.stereo_frames == 0))
      return "one could not read the recording '" + s.name + "': " + s.error + t.error;
    if (s.error.empty() && t.error.empty() &&
        (s.first_image != t.first_image || s.last_image != t.last_image))
      return "the recording '" + s.name + "' has another length";
  }
  return "";
}

}  // namespace etalon
