#include "support/systems.h"

#include <filesystem>
#include <set>

#include "etalon/core/errors.h"

namespace etalon::app {

namespace {

namespace fs = std::filesystem;

/** What a system is called: its file or folder, behind `parents` of the folders that it is in. */
std::string systemName(const fs::path& path, int parents) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  const fs::path own = whole.has_filename() ? whole : whole.parent_path();
  std::string name = (fs::is_regular_file(own) ? own.stem() : own.filename()).string();
  fs::path folder = own.parent_path();
  for (int i = 0; i < parents; ++i, folder = folder.parent_path())
    name = (folder.filename() / name).string();
  return name;
}

}  // namespace

std::vector<NamedText> systemsOf(const std::vector<std::string>& paths, size_t recordings) {
  std::vector<NamedText> systems;
  for (int parents = 0; parents < 3; ++parents) {
    systems.clear();
    std::set<std::string> names;
    for (const std::string& path : paths) {
      const fs::path replayed = fs::path(path) / "trajectory.tum";
      systems.push_back({systemName(path, parents),
                         recordings == 1 && fs::exists(replayed) ? replayed.string() : path});
      names.insert(systems.back().name);
    }
    if (names.size() == systems.size()) return systems;
  }
  throw ConfigError("the same trajectories are given twice");
}

}  // namespace etalon::app
