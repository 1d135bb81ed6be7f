#pragma once

#include <stdexcept>
#include <string>

namespace etalon {

/** Base of everything that this project throws on purpose: what() is a whole sentence for the user.
 */
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** Broken input data. The message names file, line where there is one, and what was expected. */
class DataError : public Error {
 public:
  /** @param line one-based line of `file`, 0 where the file as a whole is meant. */
  DataError(const std::string& file, int line, const std::string& message);

  const std::string& file() const { return file_; }
  int line() const { return line_; }

 private:
  std::string file_;
  int line_ = 0;
};

/** Wrong usage or configuration. */
class ConfigError : public Error {
 public:
  using Error::Error;
};

/** Thrown where work was told to stop that leaves nothing behind. */
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted") {}
};

/** A plugin that cannot be found, loaded or used. */
class PluginError : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

}  // namespace etalon
