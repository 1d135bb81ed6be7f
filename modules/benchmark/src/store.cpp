#include "etalon/benchmark/store.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <tuple>

#include "etalon/benchmark/summary.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"
#include "record_json.h"
#include "suite/suite_files.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeadName = "benchmark.json";
constexpr const char* kWindowsName = "windows.csv";
constexpr const char* kSummaryName = "summary.csv";
constexpr const char* kReportName = "report.html";

template <typename Element>
size_t placeOf(const std::vector<Element>& elements, const std::string& name) {
  const auto found = std::find_if(elements.begin(), elements.end(),
                                  [&](const Element& e) { return e.name == name; });
  return found - elements.begin();
}

}  // namespace

bool isBenchmarkFolder(const std::string& folder) { return fs::exists(pathIn(folder, kHeadName)); }

BenchmarkRecord readBenchmarkHead(const std::string& folder) {
  const std::string path = pathIn(folder, kHeadName);
  const nlohmann::json json = parseJson(readText(path), path, 0);
  return benchmarkHeadFromJson(JsonReader(json, path));
}

BenchmarkRecord readBenchmark(const std::string& folder) {
  BenchmarkRecord record = readBenchmarkHead(folder);
  ResultStore store(folder);
  for (const BenchmarkSequence& sequence : record.sequences)
    for (WindowResult& result : store.read(sequence.name))
      record.results.push_back(std::move(result));
  sortResults(&record);
  return record;
}

void writeBenchmarkHead(const std::string& folder, const BenchmarkRecord& record) {
  makeFolder(pathIn(folder, "windows"));
  OutputFiles output(folder);
  writeFile(output.path(kHeadName), jsonText(benchmarkHeadJson(record), 1) + "\n");
  std::string config = record.config;
  for (const BenchmarkInitializer& initializer : record.initializers)
    config += initializer.config + "\n";
  writeFile(output.path("config.ini"), config);
  output.putInPlace();
}

std::vector<std::string> writeBenchmarkResults(const std::string& folder,
                                               const BenchmarkRecord& record,
                                               const BenchmarkReport& report) {
  OutputFiles output(folder);
  std::vector<std::string> paths;
  const auto write = [&](const char* name, const std::string& text) {
    paths.push_back(pathIn(folder, name));
    writeFile(output.path(name), text);
  };
  write(kWindowsName, windowsCsv(windowRows(record)));
  write(kSummaryName, summaryCsv(record));
  if (report) write(kReportName, report(record));
  output.putInPlace();
  return paths;
}

bool hasBenchmarkResults(const std::string& folder) {
  return fs::exists(pathIn(folder, kWindowsName));
}

void discardBenchmark(const std::string& folder) {
  for (const char* name : {kWindowsName, kSummaryName, kReportName, "windows"})
    fs::remove_all(pathIn(folder, name));
}

std::string resultKey(const WindowResult& result) {
  return result.sequence +
         format(", %d keyframes at %.9g Hz, window %d, ", result.keyframes, result.rate_hz,
                result.window) +
         result.initializer;
}

void sortResults(BenchmarkRecord* record) {
  const auto order = [record](const WindowResult& result) {
    const auto& keyframes = record->protocol.keyframes;
    const auto& rates = record->protocol.rates_hz;
    return std::make_tuple(
        placeOf(record->sequences, result.sequence),
        std::find(keyframes.begin(), keyframes.end(), result.keyframes) - keyframes.begin(),
        std::find(rates.begin(), rates.end(), result.rate_hz) - rates.begin(), result.window,
        placeOf(record->initializers, result.initializer));
  };
  const auto listed = [record, &order](const WindowResult& result) {
    const auto [sequence, keyframes, rate, window, initializer] = order(result);
    return sequence < record->sequences.size() &&
           keyframes < static_cast<std::ptrdiff_t>(record->protocol.keyframes.size()) &&
           rate < static_cast<std::ptrdiff_t>(record->protocol.rates_hz.size()) &&
           initializer < record->initializers.size();
  };
  std::vector<std::pair<decltype(order(WindowResult())), size_t>> places;
  for (size_t i = 0; i < record->results.size(); ++i)
    if (listed(record->results[i])) places.emplace_back(order(record->results[i]), i);
  std::sort(places.begin(), places.end());
  std::vector<WindowResult> sorted;
  sorted.reserve(places.size());
  for (const auto& place : places) sorted.push_back(std::move(record->results[place.second]));
  record->results = std::move(sorted);
}

namespace {

/** The resultKey()s that a complete record has of a sequence. */
std::vector<std::string> expectedResults(const BenchmarkRecord& record,
                                         const BenchmarkSequence& sequence) {
  std::vector<std::string> keys;
  if (!sequence.error.empty()) return keys;
  WindowResult result;
  result.sequence = sequence.name;
  for (const WindowShape& shape : shapesOf(record.protocol)) {
    result.keyframes = shape.keyframes;
    result.rate_hz = shape.rate_hz;
    const int windows =
        windowCount(sequence.first_image, sequence.last_image, record.protocol.every_s, shape);
    for (result.window = 0; result.window < windows; ++result.window) {
      for (const BenchmarkInitializer& initializer : record.initializers) {
        result.initializer = initializer.name;
        keys.push_back(resultKey(result));
      }
    }
  }
  return keys;
}

/** resultKey()s of the record's results. */
std::set<std::string> resultsThere(const BenchmarkRecord& record) {
  std::set<std::string> there;
  for (const WindowResult& result : record.results) there.insert(resultKey(result));
  return there;
}

std::string ofAll(size_t missing, size_t all) {
  return std::to_string(missing) + " of " + std::to_string(all) + " results";
}

}  // namespace

std::vector<std::string> missingResults(const BenchmarkRecord& record) {
  const std::set<std::string> there = resultsThere(record);
  std::vector<std::string> missing;
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const std::string& key : expectedResults(record, sequence))
      if (there.count(key) == 0) missing.push_back(key);
  return missing;
}

std::vector<std::string> incompleteness(const BenchmarkRecord& record) {
  const std::set<std::string> there = resultsThere(record);
  size_t all = 0, all_missing = 0;
  std::vector<std::string> details;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const std::vector<std::string> expected = expectedResults(record, sequence);
    const auto missing = static_cast<size_t>(
        std::count_if(expected.begin(), expected.end(),
                      [&there](const std::string& key) { return there.count(key) == 0; }));
    all += expected.size();
    all_missing += missing;
    if (!sequence.error.empty())
      details.push_back(sequence.name + ": not in it: " + sequence.error);
    else if (missing > 0)
      details.push_back(sequence.name + ": " + ofAll(missing, expected.size()) + " missing");
  }
  std::vector<std::string> sentences;
  if (all_missing > 0)
    sentences.push_back("unfinished: " + ofAll(all_missing, all) + " are missing");
  if (record.shards > 1)
    sentences.push_back("it is shard " + std::to_string(record.shard) + " of " +
                        std::to_string(record.shards) + "; etalon merge joins the shards");
  sentences.insert(sentences.end(), details.begin(), details.end());
  return sentences;
}

std::string resultToText(const WindowResult& result) { return jsonText(resultJson(result), -1); }

WindowResult resultFromText(const std::string& text) {
  constexpr char kName[] = "a window";
  const nlohmann::json json = parseJson(text, kName, 0);
  return resultFromJson(JsonReader(json, kName));
}

namespace {

/** Drops what a writer left that was killed in the middle of a line. */
void dropUnfinishedLine(const std::string& file) {
  if (!fs::exists(file)) return;
  const std::string text = readText(file);
  const size_t end = text.rfind('\n') + 1;  // 0 where there is no line
  if (end < text.size()) fs::resize_file(file, end);
}

}  // namespace

void LineStore::read(
    const std::string& sequence,
    const std::function<void(const std::string& line, const std::string& place)>& use) const {
  const std::string file = path(sequence);
  if (!fs::exists(file)) return;
  const std::string text = readText(file);
  size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // not yet, or never, written to its end
    use(text.substr(begin, end - begin), file + ":" + std::to_string(line));
    begin = end + 1;
  }
}

void LineStore::append(const std::string& sequence, const std::string& line) {
  std::ofstream& file = files_[sequence];
  if (!file.is_open()) {
    dropUnfinishedLine(path(sequence));
    file.open(path(sequence), std::ios::binary | std::ios::app);
  }
  file << line + "\n" << std::flush;
  if (!file)
    throw DataError(path(sequence), 0, std::string("cannot be written: ") + std::strerror(errno));
}

std::string LineStore::path(const std::string& sequence) const {
  return pathIn(folder_, sequence + ".jsonl");
}

ResultStore::ResultStore(const std::string& folder) : lines_(pathIn(folder, "windows")) {}

std::vector<WindowResult> ResultStore::read(const std::string& sequence) const {
  std::vector<WindowResult> results;
  lines_.read(sequence, [&results](const std::string& line, const std::string& place) {
    results.push_back(resultFromJson(JsonReader(parseJson(line, place, 0), place)));
  });
  return results;
}

void ResultStore::append(const WindowResult& result) {
  append(result.sequence, resultToText(result));
}

void ResultStore::append(const std::string& sequence, const std::string& result_text) {
  lines_.append(sequence, result_text);
}

}  // namespace etalon
