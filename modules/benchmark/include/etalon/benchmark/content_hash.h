#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace etalon {

class RecordedSource;

/** XXH3 of 128 bit over everything that is added: fast, but not cryptographic. */
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;

  void add(const void* data, std::size_t size);
  /** Adds length and characters. */
  void add(const std::string& text);
  /** Adds the bytes of a file. @throws DataError if it cannot be read */
  void addFile(const std::string& path);

  /** 32 hexadecimal digits. */
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/**
 * Hash of the bytes, and where they matter of the names, of the files that RecordedSource::files()
 * lists.
 * @throws DataError if a file cannot be read
 */
std::string recordingHash(const RecordedSource& recording);

/** Hash of the bytes of Etalon's libraries of these names, e.g. "frontend", that are loaded. */
std::string librariesHash(const std::vector<std::string>& modules);

/** Hash of the bytes of the running program: the executable and Etalon's own libraries. */
std::string programHash();

/** Hash of a file's bytes. @throws DataError if it cannot be read */
std::string fileHash(const std::string& path);

}  // namespace etalon
