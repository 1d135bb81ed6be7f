#include "etalon/core/errors.h"

namespace etalon {

static std::string located(const std::string& file, int line, const std::string& message) {
  std::string text = file;
  if (line > 0) text += ":" + std::to_string(line);
  return text.empty() ? message : text + ": " + message;
}

DataError::DataError(const std::string& file, int line, const std::string& message)
    : Error(located(file, line, message)), file_(file), line_(line) {}

}  // namespace etalon
