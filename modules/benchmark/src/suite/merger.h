#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon {

/**
 * Joins the parts of a benchmark or trial: `Record` has differenceOf(), resultKey(), sortResults()
 * and missingResults().
 */
template <typename Record>
class Merger {
 public:
  /** @param whole,what for messages: "benchmark" and "window" */
  Merger(std::string whole, std::string what) : whole_(std::move(whole)), what_(std::move(what)) {}

  /** @param complete whether the part was not interrupted */
  void add(const std::string& folder, Record part, bool complete) {
    if (first_.empty()) {
      first_ = folder;
      merged_ = part;
      merged_.results.clear();
    } else {
      const std::string difference = differenceOf(merged_, part);
      if (!difference.empty())
        throw ConfigError("merge: '" + first_ + "' and '" + folder + "' are no parts of one " +
                          whole_ + ": " + difference);
      adoptSequences(folder, part);
    }
    all_shards_[part.shards].insert(part.shard);
    if (!complete)
      interrupted_.push_back(std::to_string(part.shard) + "/" + std::to_string(part.shards) +
                             " ('" + folder + "')");
    for (auto& result : part.results) {
      const auto [former, is_new] = owner_.emplace(resultKey(result), folder);
      if (!is_new)
        throw ConfigError("merge: a " + what_ + " is there twice, in '" + former->second +
                          "' and in '" + folder + "': " + former->first);
      merged_.results.push_back(std::move(result));
    }
  }

  Record finish() {
    merged_.shard = merged_.shards = 1;
    sortResults(&merged_);
    const std::vector<std::string> missing = missingResults(merged_);
    if (!missing.empty())
      throw ConfigError("merge: " + std::to_string(missing.size()) + " " + what_ +
                        "s are missing, the first: " + missing.front() + unfinishedParts());
    return std::move(merged_);
  }

 private:
  static bool used(const BenchmarkSequence& sequence) {
    return !sequence.content.empty() && sequence.error.empty();
  }

  /** A part knows only the recordings that it needed. */
  void adoptSequences(const std::string& folder, const Record& part) {
    for (size_t i = 0; i < merged_.sequences.size(); ++i) {
      BenchmarkSequence& known = merged_.sequences[i];
      const BenchmarkSequence& other = part.sequences[i];
      if ((used(known) && !other.error.empty()) || (used(other) && !known.error.empty()))
        throw ConfigError("merge: '" + folder +
                          "' and the parts before it: not all could use the recording '" +
                          known.name + "': " + known.error + other.error);
      if (known.content.empty() && !other.content.empty()) known = other;
      if (known.error.empty()) known.error = other.error;
    }
  }

  /** What to run for the missing results, as the end of a sentence. */
  std::string unfinishedParts() const {
    std::string text;
    if (!interrupted_.empty())
      text += "; interrupted, the same command goes on: shard " + joined(interrupted_);
    if (all_shards_.size() != 1) return text;
    const auto& [shards, there] = *all_shards_.begin();
    std::vector<std::string> absent;
    for (int shard = 1; shard <= shards; ++shard)
      if (there.count(shard) == 0) absent.push_back(std::to_string(shard));
    if (!absent.empty())
      text += "; of " + std::to_string(shards) + " shards not given: " + joined(absent, ",");
    return text;
  }

  std::string first_;
  std::string whole_, what_;
  Record merged_;                             ///< head and results of all parts so far
  std::map<int, std::set<int>> all_shards_;   ///< numbers of the parts given, by N of K/N
  std::vector<std::string> interrupted_;      ///< parts without results
  std::map<std::string, std::string> owner_;  ///< folder of each result
};

}  // namespace etalon
