#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <string>

namespace etalon::app {

// What `bench` and `trial` share.

/** Lets the first Ctrl-C (or SIGTERM) set what is returned, and the second one end the program. */
const std::atomic<bool>* stopOnSignals();

/** Declares --shard K/N. */
void addShardOption(CLI::App* command, std::string* text);
/** @throws ConfigError unless 1 <= K <= N */
void readShard(const std::string& text, int* shard, int* shards);

}  // namespace etalon::app
