#include "compare/folder_names.h"

#include <algorithm>

#include "etalon/runlog/run_log.h"

namespace etalon::app {

std::filesystem::path folderOf(const std::string& path) {
  const auto folder = std::filesystem::path(path).lexically_normal();
  return folder.filename() == kRunLogName || !folder.has_filename() ? folder.parent_path() : folder;
}

std::vector<std::string> shortNames(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    const std::string name = folderOf(path).filename().string();
    if (name.empty() || std::count(names.begin(), names.end(), name) > 0) return paths;
    names.push_back(name);
  }
  return names;
}

}  // namespace etalon::app
