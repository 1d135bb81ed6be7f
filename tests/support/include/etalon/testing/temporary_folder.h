#pragma once

#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace etalon::testing {

/** A new empty folder, removed with everything in it at the end of its life in the process that made
 * it: a fork that ends by exit() leaves it. */
class TemporaryFolder {
 public:
  TemporaryFolder() {
    path_ = (std::filesystem::temp_directory_path() / "etalon_test_XXXXXX").string();
    if (!mkdtemp(path_.data())) throw std::runtime_error("cannot make the folder " + path_);
  }
  ~TemporaryFolder() {
    if (getpid() != maker_) return;
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const {
    return std::filesystem::path(path_) / name;
  }

  /** Writes a file in it and returns the file's path. */
  std::string write(const std::string& name, const std::string& content) const {
    const std::string file = path_ + "/" + name;
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }

 private:
  std::string path_;
  pid_t maker_ = getpid();
};

}  // namespace etalon::testing
