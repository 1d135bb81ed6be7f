#include "files.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"

namespace etalon {

namespace fs = std::filesystem;

void makeFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw DataError(path, 0, "cannot be made: " + error.message());
}

void writeText(const std::string& path, const std::string& text) {
  const std::string temporary = path + ".part";
  std::ofstream file(temporary, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) fs::rename(temporary, path, error);
  if (!file || error)
    throw DataError(path, 0,
                    "cannot be written: " + (error ? error.message() : std::strerror(errno)));
}

}  // namespace etalon
