#include <filesystem>
#include <map>
#include <set>

#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

/** The first line in which two texts differ. */
std::string firstDifference(const std::string& a, const std::string& b) {
  size_t begin = 0;
  for (size_t i = 0; i <= std::min(a.size(), b.size()); ++i) {
    const bool end = i == a.size() || i == b.size();
    if (end || a[i] != b[i]) break;
    if (a[i] == '\n') begin = i + 1;
  }
  const auto line = [begin](const std::string& text) {
    return "'" + text.substr(begin, text.find('\n', begin) - begin) + "'";
  };
  return line(a) + " and " + line(b);
}

/** Versions in which two builds differ, and the beginnings of their hashes. */
std::string differenceOfPrograms(const BenchmarkRecord& a, const BenchmarkRecord& b) {
  std::string details;
  for (const auto& [name, version] : a.versions) {
    const auto other = b.versions.find(name);
    if (other != b.versions.end() && other->second != version)
      details.append(name).append(" ").append(version).append(" and ").append(other->second) +=
          ", ";
  }
  details += "hashes " + a.binaries.substr(0, 8) + "... and " + b.binaries.substr(0, 8) + "...";
  return "another build of etalon (" + details + ")";
}

std::string differenceOfProtocols(const BenchmarkProtocol& a, const BenchmarkProtocol& b) {
  if (a.every_s != b.every_s)
    return "windows every " + std::to_string(a.every_s) + " s and every " +
           std::to_string(b.every_s) + " s";
  if (a.keyframes != b.keyframes || a.rates_hz != b.rates_hz || a.min_keyframes != b.min_keyframes)
    return "other windows (keyframes, rates)";
  if (a.vi_ba != b.vi_ba) return "one is with VI-BA, the other without";
  return "";
}

std::string differenceOfInitializers(const std::vector<BenchmarkInitializer>& a,
                                     const std::vector<BenchmarkInitializer>& b) {
  if (a.size() != b.size()) return "other initializers";
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].name != b[i].name)
      return "other initializers ('" + a[i].name + "' and '" + b[i].name + "')";
    if (a[i].binary != b[i].binary) return "another build of the plugin '" + a[i].name + "'";
    if (a[i].config != b[i].config)
      return "another configuration of '" + a[i].name +
             "': " + firstDifference(a[i].config, b[i].config);
  }
  return "";
}

/** Joins the parts; `merged` holds head and results of all parts so far. */
class Merger {
 public:
  void add(const std::string& folder, BenchmarkRecord part) {
    if (first_.empty()) {
      first_ = folder;
      merged_ = part;
      merged_.results.clear();
    } else {
      const std::string difference = differenceOf(merged_, part);
      if (!difference.empty())
        throw ConfigError("merge: '" + first_ + "' and '" + folder +
                          "' are no parts of one benchmark: " + difference);
      adoptSequences(folder, part);
    }
    all_shards_[part.shards].insert(part.shard);
    if (!hasBenchmarkResults(folder))
      interrupted_.push_back(std::to_string(part.shard) + "/" + std::to_string(part.shards) +
                             " ('" + folder + "')");
    for (WindowResult& result : part.results) {
      const auto [former, is_new] = owner_.emplace(resultKey(result), folder);
      if (!is_new)
        throw ConfigError("merge: a window is there twice, in '" + former->second + "' and in '" +
                          folder + "': " + former->first);
      merged_.results.push_back(std::move(result));
    }
  }

  BenchmarkRecord finish() {
    merged_.shard = merged_.shards = 1;
    sortResults(&merged_);
    const std::vector<std::string> missing = missingResults(merged_);
    if (!missing.empty())
      throw ConfigError("merge: " + std::to_string(missing.size()) +
                        " windows are missing, the first: " + missing.front() + unfinishedParts());
    return std::move(merged_);
  }

 private:
  static bool used(const BenchmarkSequence& sequence) {
    return !sequence.content.empty() && sequence.error.empty();
  }

  /** A part knows only the recordings that it needed. */
  void adoptSequences(const std::string& folder, const BenchmarkRecord& part) {
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
  BenchmarkRecord merged_;
  std::map<int, std::set<int>> all_shards_;   ///< numbers of the parts given, by N of K/N
  std::vector<std::string> interrupted_;      ///< parts without results
  std::map<std::string, std::string> owner_;  ///< folder of each result
};

}  // namespace

std::string differenceOf(const BenchmarkRecord& a, const BenchmarkRecord& b) {
  if (a.binaries != b.binaries) return differenceOfPrograms(a, b);
  if (a.config != b.config) return "another configuration: " + firstDifference(a.config, b.config);
  for (const std::string& difference : {differenceOfProtocols(a.protocol, b.protocol),
                                        differenceOfInitializers(a.initializers, b.initializers)})
    if (!difference.empty()) return difference;
  if (a.sequences.size() != b.sequences.size()) return "other recordings";
  for (size_t i = 0; i < a.sequences.size(); ++i) {
    const BenchmarkSequence& s = a.sequences[i];
    const BenchmarkSequence& t = b.sequences[i];
    if (s.name != t.name) return "other recordings ('" + s.name + "' and '" + t.name + "')";
    if (!s.content.empty() && !t.content.empty() && s.content != t.content)
      return "the recording '" + s.name + "' has other content";
    // The windows are divided over the recordings that could be opened.
    if ((a.shards > 1 || b.shards > 1) && (s.stereo_frames == 0) != (t.stereo_frames == 0))
      return "one could not read the recording '" + s.name + "': " + s.error + t.error;
    if (s.error.empty() && t.error.empty() &&
        (s.first_image != t.first_image || s.last_image != t.last_image))
      return "the recording '" + s.name + "' has another length";
  }
  return "";
}

BenchmarkOutcome mergeBenchmarks(const std::vector<std::string>& folders, const std::string& out,
                                 bool overwrite, const BenchmarkReport& report) {
  std::vector<std::string> empty;
  for (const std::string& folder : folders)
    if (!isBenchmarkFolder(folder)) empty.push_back("'" + folder + "'");
  if (!empty.empty())
    throw ConfigError("merge: there is no benchmark (benchmark.json) in " + joined(empty));
  if (isBenchmarkFolder(out) && !overwrite)
    throw ConfigError("merge: '" + out +
                      "' holds a benchmark already; choose another --out, or --overwrite it");
  Merger merger;
  for (const std::string& folder : folders) merger.add(folder, readBenchmark(folder));
  BenchmarkOutcome outcome;
  outcome.record = merger.finish();
  makeFolder(out);
  const FolderLock lock(out);
  OutputFiles output(out);
  const std::string folder = output.path("");
  writeBenchmarkHead(folder, outcome.record);
  ResultStore store(folder);
  for (const WindowResult& result : outcome.record.results) store.append(result);
  outcome.results_found = outcome.record.results.size();
  requireCoverage(&outcome.record, kMinCoverage);
  for (const std::string& file : writeBenchmarkResults(folder, outcome.record, report))
    outcome.files.push_back((fs::path(out) / fs::path(file).filename()).string());
  discardBenchmark(out);
  output.putInPlace();
  return outcome;
}

}  // namespace etalon
