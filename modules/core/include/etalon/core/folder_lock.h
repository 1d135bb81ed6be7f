#pragma once

#include <string>

namespace etalon {

/** Keeps a second process out of a folder as long as it lives. */
class FolderLock {
 public:
  /** @throws ConfigError if another process holds the folder */
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1;
};

}  // namespace etalon
