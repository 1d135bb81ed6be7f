#pragma once

#include <filesystem>
#include <vector>

namespace etalon::app {

/** Folders that a command makes for what it writes. Those that are empty at the end, because it was
 * not finished, are removed. */
class NewFolders {
 public:
  /** @param folder to be made, perhaps with those that it is in */
  explicit NewFolders(const std::filesystem::path& folder);
  ~NewFolders();
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;

 private:
  std::vector<std::filesystem::path> missing_;  ///< the innermost first
};

}  // namespace etalon::app
