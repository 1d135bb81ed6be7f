#pragma once

#include <string>

namespace etalon {

/** Keeps a second process out of a folder as long as it lives. */
class FolderLock {
 public:
  /** @throws ConfigError if another process holds the folder; DataError if the folder is not there,
   * cannot be written, or lies on a file system that has no locks */
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1;
};

/**
 * Lets one process (or thread) at a time change files of a folder; the others wait. On a file system
 * without locks it does nothing. This is not FolderLock's lock: a process that holds that one for its
 * whole run also changes files in its folder, and would wait for itself.
 */
class FolderTurn {
 public:
  explicit FolderTurn(const std::string& folder);
  ~FolderTurn();
  FolderTurn(const FolderTurn&) = delete;
  FolderTurn& operator=(const FolderTurn&) = delete;

 private:
  int file_;
};

}  // namespace etalon
