#include "etalon/core/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"

namespace etalon {

namespace fs = std::filesystem;

namespace {

/**
 * The first of "<path>.<process>.part", "<path>.<process>-1.part", ... that `make` can make.
 * @param make leaves errno at EEXIST where the name is taken
 */
std::string madeTemporary(const std::string& path,
                          const std::function<bool(const std::string&)>& make) {
  for (int i = 0;; ++i) {
    std::string name = path + "." + std::to_string(getpid());
    if (i > 0) name += "-" + std::to_string(i);
    name += ".part";
    if (make(name)) return name;
    if (errno != EEXIST)
      throw DataError(path, 0, std::string("cannot be created: ") + std::strerror(errno));
  }
}

bool makeEmptyFile(const std::string& path) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  return file >= 0 && close(file) == 0;
}

/** The file that a symbolic link points to; the link itself stays. */
std::string behindLinks(const std::string& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  const fs::path resolved = fs::weakly_canonical(path, error);
  return error ? path : resolved.string();
}

}  // namespace

bool makeFolder(const std::string& path) {
  std::error_code error;
  const bool made = fs::create_directories(path, error);
  if (error) throw DataError(path, 0, "cannot be made: " + error.message());
  return made;
}

OutputFile::OutputFile(const std::string& path) : path_(behindLinks(path)) {
  std::error_code error;
  const fs::file_status there = fs::status(path_, error);
  const bool is_device = fs::exists(there) && !fs::is_regular_file(there);
  temporary_ = is_device ? path_ : madeTemporary(path_, makeEmptyFile);
  stream_.open(temporary_, std::ios::binary);
  if (!stream_) {
    if (!is_device) fs::remove(temporary_, error);
    fail();
  }
}

OutputFile::~OutputFile() {
  if (in_place_ || temporary_ == path_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void OutputFile::putInPlace() {
  errno = 0;
  stream_.close();
  if (!stream_) fail();
  if (temporary_ != path_ && std::rename(temporary_.c_str(), path_.c_str()) != 0) fail();
  in_place_ = true;
}

void OutputFile::fail() const {
  throw DataError(path_, 0,
                  std::string("cannot be written: ") +
                      (errno != 0 ? std::strerror(errno) : "is the disk full?"));
}

void writeFile(const std::string& path, const std::string& content) {
  OutputFile file(path);
  file.stream() << content << std::flush;
  if (!file.stream()) file.fail();
  file.putInPlace();
}

OutputFiles::OutputFiles(const std::string& folder) : folder_(folder) {
  makeFolder(folder);
  temporary_ = madeTemporary((fs::path(folder) / "new").string(), [](const std::string& name) {
    return mkdir(name.c_str(), 0777) == 0;
  });
}

OutputFiles::~OutputFiles() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
}

void OutputFiles::putInPlace() {
  const FolderTurn turn(folder_);
  std::error_code error;
  std::vector<fs::path> written;
  for (fs::directory_iterator i(temporary_, error), end; !error && i != end; i.increment(error))
    written.push_back(i->path());
  if (error) throw DataError(temporary_, 0, "cannot be read: " + error.message());
  std::sort(written.begin(), written.end());
  const auto place = [this](const fs::path& from) { return fs::path(folder_) / from.filename(); };
  for (const fs::path& from : written)  // before anything has moved
    if (!fs::is_directory(from, error) && fs::is_directory(place(from), error))
      throw DataError(place(from).string(), 0, "cannot be written: a folder has this name");
  for (const fs::path& from : written) {
    const fs::path to = place(from);
    if (fs::is_directory(from, error)) fs::remove_all(to, error);
    fs::rename(from, to, error);
    if (error) throw DataError(to.string(), 0, "cannot be written: " + error.message());
  }
}

}  // namespace etalon
