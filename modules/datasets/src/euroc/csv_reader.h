#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "etalon/core/time.h"

namespace etalon {

/** What the stamps of a file must be. */
enum class StampOrder { kIncreasing, kAny };

/**
 * Reads a comma-separated file of stamps, strictly increasing ones if not said otherwise, one row at
 * a time. Lines that start
 * with '#' and empty lines are skipped, CRLF is tolerated. Whatever is wrong throws DataError with
 * file, line and what was expected.
 */
class CsvReader {
 public:
  /** @param columns what the file should hold, in words: "7 columns (stamp [ns], ...)". */
  CsvReader(const std::string& path, std::string columns,
            StampOrder order = StampOrder::kIncreasing);

  /** Goes to the next row, whose number of fields must be one of `counts`; false at the end of the
   * file. */
  bool next(const std::vector<size_t>& counts);

  size_t size() const { return fields_.size(); }
  int line() const { return line_; }
  /** Stamp of the row, ns. */
  TimeNs stamp() const { return stamp_; }
  std::string_view text(size_t column) const { return fields_[column]; }
  /** A finite number. */
  double number(size_t column) const;
  /** A number, or `nan`, `inf` or `-inf`, which whoever uses measurements has to recognize. */
  double measurement(size_t column) const;

  [[noreturn]] void fail(const std::string& message) const;

 private:
  void split();
  void parseStamp();
  double parse(size_t column, bool finite) const;

  std::string path_, columns_;
  StampOrder order_;
  std::ifstream in_;
  std::string row_;
  std::vector<std::string_view> fields_;
  int line_ = 0;
  TimeNs stamp_ = 0;
  bool first_ = true;
};

}  // namespace etalon
