#include "etalon/benchmark/benchmark_store.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <sstream>
#include <tuple>

#include "benchmark_json.h"
#include "etalon/benchmark/benchmark_slots.h"
#include "etalon/benchmark/benchmark_summary.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using ReplaceInvalid = nlohmann::ordered_json::error_handler_t;

constexpr const char* kHeadName = "benchmark.json";
constexpr const char* kSegmentsName = "segments.csv";
constexpr const char* kSummaryName = "summary.csv";
constexpr const char* kReportName = "report.html";

std::string pathIn(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw DataError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
  return text.str();
}

nlohmann::json parseJson(const std::string& text, const std::string& path, int line) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    throw DataError(path, line, std::string("expected JSON: ") + e.what());
  }
}

template <typename Element>
size_t placeOf(const std::vector<Element>& elements, const std::string& name) {
  const auto found = std::find_if(elements.begin(), elements.end(),
                                  [&](const Element& e) { return e.name == name; });
  return static_cast<size_t>(found - elements.begin());
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
  SlotStore store(folder);
  for (const BenchmarkSequence& sequence : record.sequences)
    for (SlotRecord& slot : store.read(sequence.name)) record.slots.push_back(std::move(slot));
  sortSlots(&record);
  return record;
}

void writeBenchmarkHead(const std::string& folder, const BenchmarkRecord& record) {
  makeFolder(pathIn(folder, "slots"));
  OutputFiles output(folder);
  writeFile(output.path(kHeadName),
            benchmarkHeadJson(record).dump(1, ' ', false, ReplaceInvalid::replace) + "\n");
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
  write(kSegmentsName, segmentsCsv(segmentRows(record)));
  write(kSummaryName, summaryCsv(record));
  if (report) write(kReportName, report(record));
  output.putInPlace();
  return paths;
}

bool hasBenchmarkResults(const std::string& folder) {
  return fs::exists(pathIn(folder, kSegmentsName));
}

void discardBenchmark(const std::string& folder) {
  for (const char* name : {kSegmentsName, kSummaryName, kReportName, "slots"})
    fs::remove_all(pathIn(folder, name));
}

std::string slotKey(const SlotRecord& slot) {
  char rate[40];
  std::snprintf(rate, sizeof rate, "%.9g", slot.rate_hz);
  return slot.sequence + ", " + std::to_string(slot.keyframes) + " keyframes at " + rate +
         " Hz, slot " + std::to_string(slot.segment) + ", " + slot.initializer;
}

void sortSlots(BenchmarkRecord* record) {
  const auto order = [record](const SlotRecord& slot) {
    const auto& keyframes = record->protocol.keyframes;
    const auto& rates = record->protocol.rates_hz;
    return std::make_tuple(
        placeOf(record->sequences, slot.sequence),
        std::find(keyframes.begin(), keyframes.end(), slot.keyframes) - keyframes.begin(),
        std::find(rates.begin(), rates.end(), slot.rate_hz) - rates.begin(), slot.segment,
        placeOf(record->initializers, slot.initializer));
  };
  const auto listed = [record, &order](const SlotRecord& slot) {
    const auto [sequence, keyframes, rate, segment, initializer] = order(slot);
    return sequence < record->sequences.size() &&
           keyframes < static_cast<std::ptrdiff_t>(record->protocol.keyframes.size()) &&
           rate < static_cast<std::ptrdiff_t>(record->protocol.rates_hz.size()) &&
           initializer < record->initializers.size();
  };
  std::vector<std::pair<decltype(order(SlotRecord())), size_t>> places;
  for (size_t i = 0; i < record->slots.size(); ++i)
    if (listed(record->slots[i])) places.emplace_back(order(record->slots[i]), i);
  std::sort(places.begin(), places.end());
  std::vector<SlotRecord> sorted;
  sorted.reserve(places.size());
  for (const auto& place : places) sorted.push_back(std::move(record->slots[place.second]));
  record->slots = std::move(sorted);
}

namespace {

/** What a complete record has of a sequence, as slotKey() names it. */
std::vector<std::string> expectedSlots(const BenchmarkRecord& record,
                                       const BenchmarkSequence& sequence) {
  std::vector<std::string> keys;
  if (!sequence.error.empty()) return keys;
  SlotRecord slot;
  slot.sequence = sequence.name;
  for (const BenchmarkWindow& window : windowsOf(record.protocol)) {
    slot.keyframes = window.keyframes;
    slot.rate_hz = window.rate_hz;
    const int slots =
        slotCount(sequence.first_image, sequence.last_image, record.protocol.every_s, window);
    for (slot.segment = 0; slot.segment < slots; ++slot.segment) {
      for (const BenchmarkInitializer& initializer : record.initializers) {
        slot.initializer = initializer.name;
        keys.push_back(slotKey(slot));
      }
    }
  }
  return keys;
}

/** slotKey()s of the record's slots. */
std::set<std::string> slotsThere(const BenchmarkRecord& record) {
  std::set<std::string> there;
  for (const SlotRecord& slot : record.slots) there.insert(slotKey(slot));
  return there;
}

std::string ofAll(size_t missing, size_t all) {
  return std::to_string(missing) + " of " + std::to_string(all) + " results";
}

}  // namespace

std::vector<std::string> missingSlots(const BenchmarkRecord& record) {
  const std::set<std::string> there = slotsThere(record);
  std::vector<std::string> missing;
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const std::string& key : expectedSlots(record, sequence))
      if (there.count(key) == 0) missing.push_back(key);
  return missing;
}

std::vector<std::string> incompleteness(const BenchmarkRecord& record) {
  const std::set<std::string> there = slotsThere(record);
  size_t all = 0, all_missing = 0;
  std::vector<std::string> details;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const std::vector<std::string> expected = expectedSlots(record, sequence);
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

std::string slotToText(const SlotRecord& slot) {
  return slotJson(slot).dump(-1, ' ', false, ReplaceInvalid::replace);
}

SlotRecord slotFromText(const std::string& text) {
  constexpr char kName[] = "a slot";
  const nlohmann::json json = parseJson(text, kName, 0);
  return slotFromJson(JsonReader(json, kName));
}

SlotStore::SlotStore(std::string folder) : folder_(std::move(folder)) {}

std::string SlotStore::path(const std::string& sequence) const {
  return pathIn(folder_, "slots/" + sequence + ".jsonl");
}

std::vector<SlotRecord> SlotStore::read(const std::string& sequence) {
  std::vector<SlotRecord> slots;
  const std::string file = path(sequence);
  if (!fs::exists(file)) return slots;
  const std::string text = readText(file);
  size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const size_t end = text.find('\n', begin);
    if (end == std::string::npos) {  // the writer was killed in the middle of this line
      fs::resize_file(file, begin);
      break;
    }
    const nlohmann::json json = parseJson(text.substr(begin, end - begin), file, line);
    slots.push_back(slotFromJson(JsonReader(json, file + ":" + std::to_string(line))));
    begin = end + 1;
  }
  return slots;
}

void SlotStore::append(const SlotRecord& slot) { append(slot.sequence, slotToText(slot)); }

void SlotStore::append(const std::string& sequence, const std::string& slot_text) {
  std::ofstream& file = files_[sequence];
  if (!file.is_open()) file.open(path(sequence), std::ios::binary | std::ios::app);
  file << slot_text + "\n" << std::flush;
  if (!file)
    throw DataError(path(sequence), 0, std::string("cannot be written: ") + std::strerror(errno));
}

}  // namespace etalon
