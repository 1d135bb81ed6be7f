#pragma once

#include <fstream>
#include <string>

namespace etalon {

/** Makes a folder and its missing parents; returns whether it is new. @throws DataError if it
 * cannot be made */
bool makeFolder(const std::string& path);

/**
 * A file that appears under its name only when it is complete. Until then it is written beside,
 * under a name of its own (PATH.PROCESS.part). If several processes write the same file, the last
 * one wins. Anything but a regular file, a device for instance, is written directly.
 */
class OutputFile {
 public:
  /** @throws DataError if nothing can be written there */
  explicit OutputFile(const std::string& path);
  /** Removes what has not been put in place. */
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /** To write to; what fails there is found by putInPlace() at the latest. */
  std::ofstream& stream() { return stream_; }
  /** Closes the file and gives it its name. @throws DataError if not all of it could be written */
  void putInPlace();
  /** @throws DataError that the file cannot be written, with the system's reason */
  [[noreturn]] void fail() const;

 private:
  std::string path_, temporary_;
  std::ofstream stream_;
  bool in_place_ = false;
};

/** Writes a whole file through OutputFile. @throws DataError if it cannot */
void writeFile(const std::string& path, const std::string& content);

/**
 * Files of one result, which take their places together: they are written into a folder of their
 * own inside `folder`, which is made if need be, and moved from there when all of them are whole.
 */
class OutputFiles {
 public:
  /** @throws DataError if nothing can be written there */
  explicit OutputFiles(const std::string& folder);
  /** Removes what has not been put in place. */
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /** Where the file or folder `name` is to be written until then. */
  std::string path(const std::string& name) const { return temporary_ + "/" + name; }
  /** Moves all that was written to `folder`; a file or folder of the same name there is replaced.
   * @throws DataError naming what cannot be moved */
  void putInPlace();

 private:
  std::string folder_, temporary_;
};

}  // namespace etalon
