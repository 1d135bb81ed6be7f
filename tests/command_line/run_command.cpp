#include "run_command.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace etalon::testing {

namespace {

std::string readFile(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/** Files for what a process prints. */
class Output {
 public:
  const std::string& out() const { return out_; }
  const std::string& err() const { return err_; }

  /** Waits for the process that writes to them. */
  CommandResult of(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readFile(out_), readFile(err_)};
  }

 private:
  TemporaryFolder folder_;
  std::string out_ = folder_.write("out", ""), err_ = folder_.write("err", "");
};

}  // namespace

CommandResult runProgram(const std::string& program, const std::vector<std::string>& arguments) {
  const Output output;
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.out().c_str(),
                                   O_WRONLY | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, output.err().c_str(),
                                   O_WRONLY | O_TRUNC, 0600);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot run " + words[0]);
  return output.of(child);
}

CommandResult runForked(const std::function<int()>& command) {
  const Output output;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) {
    const auto open_as = [](int descriptor, const std::string& path, int flags) {
      const int file = open(path.c_str(), flags);
      if (file < 0 || dup2(file, descriptor) < 0) std::_Exit(126);
      close(file);
    };
    open_as(STDIN_FILENO, "/dev/null", O_RDONLY);
    open_as(STDOUT_FILENO, output.out(), O_WRONLY | O_TRUNC);
    open_as(STDERR_FILENO, output.err(), O_WRONLY | O_TRUNC);
    // An exception ends the process: it must not reach the tests, which would go on in both.
    const int exit_code = [&]() noexcept { return command(); }();
    std::fflush(nullptr);
    std::_Exit(exit_code);  // what the tests hold (their folders) is the parent's to destroy
  }
  return output.of(child);
}

}  // namespace etalon::testing
