#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace etalon::app {

/** The folder of a run that is named by it or by its run.rawlog; empty for the working folder. */
std::filesystem::path folderOf(const std::string& path);

/** The folders' names without their parents, if these differ; else the paths as they are. */
std::vector<std::string> shortNames(const std::vector<std::string>& paths);

}  // namespace etalon::app
