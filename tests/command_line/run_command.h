#pragma once

#include <string>
#include <vector>

namespace etalon::testing {

/** What a run of the executable left. */
struct CommandResult {
  int exit_code = -1;  ///< -1 if it was ended by a signal
  std::string out, err;
};

/** Runs a program with these arguments, no shell between, and waits for it. */
CommandResult runProgram(const std::string& program, const std::vector<std::string>& arguments);

/** The same with the built `etalon`. */
CommandResult runEtalon(const std::vector<std::string>& arguments);

/** A new empty folder, removed with everything in it at the end of its life. */
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  /** Writes a file in it and returns the file's path. */
  std::string write(const std::string& name, const std::string& content) const;

 private:
  std::string path_;
};

}  // namespace etalon::testing
