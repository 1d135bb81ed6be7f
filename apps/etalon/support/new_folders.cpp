#include "support/new_folders.h"

#include <system_error>

namespace etalon::app {

NewFolders::NewFolders(const std::filesystem::path& folder) {
  std::error_code error;
  for (auto missing = std::filesystem::absolute(folder).lexically_normal();
       !std::filesystem::exists(missing, error) && !error; missing = missing.parent_path())
    missing_.push_back(missing);
}

NewFolders::~NewFolders() {
  std::error_code error;
  for (const std::filesystem::path& folder : missing_)
    if (std::filesystem::is_directory(folder, error)) std::filesystem::remove(folder, error);
}

}  // namespace etalon::app
