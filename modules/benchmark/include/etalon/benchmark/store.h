#pragma once

#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "etalon/benchmark/record.h"

namespace etalon {

// The folder of a benchmark (docs/evaluation.md):
//   benchmark.json         everything of BenchmarkRecord but its results
//   windows/<sequence>.jsonl a line a finished window and initializer, as they come
//   config.ini             the effective configuration
//   windows.csv, summary.csv, report.html   written at the end
//   tracks/                the front end's tracks (sequence_tracks.h)

/** Whether the folder holds a benchmark, finished or not. */
bool isBenchmarkFolder(const std::string& folder);

/**
 * The benchmark in a folder; an unfinished one has only the results that are there.
 * @throws DataError naming file, line and what was expected
 */
BenchmarkRecord readBenchmark(const std::string& folder);

/** Reads benchmark.json alone: a record without results. */
BenchmarkRecord readBenchmarkHead(const std::string& folder);

/** Writes benchmark.json and config.ini. @throws DataError if they cannot be written */
void writeBenchmarkHead(const std::string& folder, const BenchmarkRecord& record);

/** Makes the HTML report of a finished benchmark (benchmarkReportHtml). */
using BenchmarkReport = std::function<std::string(const BenchmarkRecord&)>;

/** Writes windows.csv, summary.csv and, if `report` is given, report.html. Returns their paths. */
std::vector<std::string> writeBenchmarkResults(const std::string& folder,
                                               const BenchmarkRecord& record,
                                               const BenchmarkReport& report);

/** Whether these files were written: an interrupted benchmark has none. */
bool hasBenchmarkResults(const std::string& folder);

/** Removes results and tables, so that none of them outlive a benchmark that starts again. */
void discardBenchmark(const std::string& folder);

/** The unique key of a result: sequence, keyframes, rate, window, initializer. */
std::string resultKey(const WindowResult& result);

/**
 * What is missing for the record to be complete, in sentences: results in all and by recording,
 * shards, recordings that could not be used. Empty if nothing is missing.
 */
std::vector<std::string> incompleteness(const BenchmarkRecord& record);

/** A result as its line in windows/, without the line's end. Numbers are read back bit for bit
 * (rotations, stored as quaternions, to rounding). */
std::string resultToText(const WindowResult& result);
/** @throws DataError if the text is no result */
WindowResult resultFromText(const std::string& text);

/** Puts the results into the order of BenchmarkRecord::results; drops those that the head does not
 * list. */
void sortResults(BenchmarkRecord* record);

/** The results that are missing for the record to be complete, as resultKey() names them. */
std::vector<std::string> missingResults(const BenchmarkRecord& record);

/**
 * Lines of text in one file a recording, appended as they come, so that interrupted work loses
 * nothing.
 */
class LineStore {
 public:
  explicit LineStore(std::string folder) : folder_(std::move(folder)) {}

  /** Calls `use` for every line of a recording, with the line's place for messages. A last line
   * without an end is left out: its writer is still at it, or was killed. */
  void read(
      const std::string& sequence,
      const std::function<void(const std::string& line, const std::string& place)>& use) const;
  /** The first call drops a last line without an end. Call it under the FolderLock.
   * @throws DataError if it cannot be written */
  void append(const std::string& sequence, const std::string& line);

 private:
  std::string path(const std::string& sequence) const;

  std::string folder_;
  std::map<std::string, std::ofstream> files_;
};

/** The finished results of a benchmark. */
class ResultStore {
 public:
  explicit ResultStore(const std::string& folder);

  /** Reads a sequence's lines (LineStore::read()). @throws DataError for lines that are no results */
  std::vector<WindowResult> read(const std::string& sequence) const;

  /** @throws DataError if it cannot be written */
  void append(const WindowResult& result);
  /** The same, given resultToText() of a result of this sequence. */
  void append(const std::string& sequence, const std::string& result_text);

 private:
  LineStore lines_;
};

}  // namespace etalon
