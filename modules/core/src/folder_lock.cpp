#include "etalon/core/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "etalon/core/errors.h"

namespace etalon {

FolderLock::FolderLock(const std::string& folder) {
  const std::string path = folder + "/.lock";
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0)
    throw DataError(path, 0, std::string("cannot be written: ") + std::strerror(errno));
  int locked = 0;
  do {
    locked = flock(file_, LOCK_EX | LOCK_NB);
  } while (locked != 0 && errno == EINTR);
  if (locked == 0) return;
  const int error = errno;
  close(file_);
  if (error != EWOULDBLOCK)
    throw DataError(path, 0, std::string("cannot be locked: ") + std::strerror(error));
  throw ConfigError("another etalon is writing into '" + folder +
                    "'; wait for it, or choose another --out");
}

FolderLock::~FolderLock() { close(file_); }

FolderTurn::FolderTurn(const std::string& folder)
    : file_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (file_ < 0) return;
  while (flock(file_, LOCK_EX) != 0 && errno == EINTR) {
  }
}

FolderTurn::~FolderTurn() {
  if (file_ >= 0) close(file_);
}

}  // namespace etalon
