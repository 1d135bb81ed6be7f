#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

namespace etalon::fuzz {

/** The bytes of one input, taken from the front; zeros once they are used up. */
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  bool empty() const { return size_ == 0; }
  template <typename T>
  T take() {
    T value{};
    const std::size_t n = size_ < sizeof value ? size_ : sizeof value;
    std::memcpy(&value, data_, n);
    data_ += n;
    size_ -= n;
    return value;
  }
  std::string rest() {
    const std::string text(reinterpret_cast<const char*>(data_), size_);
    size_ = 0;
    return text;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

/** A folder of this process in memory, which is gone at its end. */
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = "/dev/shm/etalon_fuzz_XXXXXX";
    if (!mkdtemp(name.data())) std::abort();
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/** Writes `content` to `name` in a folder that lives as long as the process. Returns its path. */
inline std::string inFile(const std::string& name, const std::string& content) {
  static const ScratchFolder folder;
  const std::string path = folder / name;
  writeFile(path, content);
  return path;
}

/** Calls a reader; what it refuses in words is as good as what it reads. */
template <typename Read>
void mayRefuse(const Read& read) {
  try {
    read();
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): the answer to broken input
  }
}

}  // namespace etalon::fuzz
