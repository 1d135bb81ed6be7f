#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <thread>

namespace etalon::app {

// What `bench` and `trial` share.

/** How the runs are made and where their results go. The object must live until the command has
 * run. */
struct SuiteOptions {
  std::string out;
  double time_limit_s = 0.0;
  std::string shard = "1/1", format = "text";
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool overwrite = false, verbose = false;

  /** What the options are, for the help. */
  struct Texts {
    std::string jobs, time_limit, format, verbose;
  };
  /** Declares --jobs, --time-limit, --out, --shard, --overwrite, --format and --verbose. */
  void add(CLI::App* command, const Texts& texts);
};

/** @throws ConfigError unless 1 <= K <= N */
void readShard(const std::string& text, int* shard, int* shards);

}  // namespace etalon::app
