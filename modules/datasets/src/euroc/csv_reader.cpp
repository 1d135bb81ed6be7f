#include "euroc/csv_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"

namespace etalon {

namespace {

std::string_view trimmed(std::string_view text) {
  const size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

}  // namespace

CsvReader::CsvReader(const std::string& path, std::string columns, StampOrder order)
    : path_(path), columns_(std::move(columns)), order_(order) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw DataError(path, 0, "there is no such file; expected a CSV file with " + columns_);
  in_.open(path);
  if (!in_) throw DataError(path, 0, "cannot be opened; expected a CSV file with " + columns_);
}

bool CsvReader::next(const std::vector<size_t>& counts) {
  while (std::getline(in_, row_)) {
    if (++line_ == 1) row_ = withoutByteOrderMark(row_);
    const std::string_view content = trimmed(row_);
    if (content.empty() || content.front() == '#') continue;
    split();
    if (std::find(counts.begin(), counts.end(), fields_.size()) == counts.end())
      fail("expected " + columns_ + ", found " + std::to_string(fields_.size()));
    parseStamp();
    return true;
  }
  if (in_.bad()) fail("reading failed");
  return false;
}

void CsvReader::split() {
  fields_.clear();
  std::string_view rest = row_;
  for (;;) {
    const size_t comma = rest.find(',');
    fields_.push_back(trimmed(rest.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
}

void CsvReader::parseStamp() {
  const std::string_view field = fields_.front();
  TimeNs stamp = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), stamp);
  if (error != std::errc() || end != field.data() + field.size() || !isStamp(stamp))
    fail("expected a stamp in whole nanoseconds from 0 to " + std::to_string(kLastStamp) +
         ", found '" + std::string(field) + "'");
  if (order_ == StampOrder::kIncreasing && !first_ && stamp <= stamp_)
    fail("expected strictly increasing stamps, found " + std::to_string(stamp) + " after " +
         std::to_string(stamp_) + (stamp == stamp_ ? " (duplicate)" : ""));
  first_ = false;
  stamp_ = stamp;
}

double CsvReader::number(size_t column) const { return parse(column, true); }

double CsvReader::measurement(size_t column) const { return parse(column, false); }

double CsvReader::parse(size_t column, bool finite) const {
  std::string_view field = fields_[column];
  if (!field.empty() && field.front() == '+') field.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size() ||
      (finite && !std::isfinite(value)))
    fail(std::string("expected a ") + (finite ? "finite " : "") + "number in column " +
         std::to_string(column + 1) + ", found '" + std::string(fields_[column]) + "'");
  return value;
}

void CsvReader::fail(const std::string& message) const { throw DataError(path_, line_, message); }

}  // namespace etalon
