#include "etalon/simulation/recorded_files.h"

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"

namespace etalon {

namespace {

/** Rows of a stamp and numbers, separated by commas. */
class NumberFile {
 public:
  NumberFile(const std::string& path, std::string expected)
      : path_(path), expected_(std::move(expected)), in_(path) {
    if (!in_) throw DataError(path, 0, "cannot be read; expected " + expected_);
  }

  /** The next row; false at the end of the file. */
  bool next() {
    std::string text;
    while (std::getline(in_, text)) {
      if (++line_ == 1) text = withoutByteOrderMark(text);
      while (!text.empty() && (text.back() == '\r' || text.back() == ' ')) text.pop_back();
      if (text.empty() || text.front() == '#') continue;
      parse(text);
      ++rows_;
      return true;
    }
    if (in_.bad()) fail("cannot be read to its end");
    return false;
  }

  TimeNs stamp() const { return stamp_; }
  const std::vector<double>& numbers() const { return numbers_; }

  [[noreturn]] void fail(const std::string& message) const {
    throw DataError(path_, line_, message + "; expected " + expected_);
  }

  void requireRows(int count) const {
    if (rows_ < count) {
      throw DataError(path_, 0,
                      "has " + std::to_string(rows_) + " rows; expected at least " +
                          std::to_string(count) + " of " + expected_);
    }
  }

 private:
  void parse(std::string_view text) {
    numbers_.clear();
    bool first = true;
    for (size_t begin = 0; begin <= text.size();) {
      const size_t comma = std::min(text.find(',', begin), text.size());
      std::string_view field = text.substr(begin, comma - begin);
      while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
      while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
      if (first) {
        parseStamp(field);
      } else {
        parseNumber(field);
      }
      first = false;
      begin = comma + 1;
    }
  }

  void parseStamp(std::string_view field) {
    TimeNs stamp = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), stamp);
    if (error != std::errc() || end != field.data() + field.size() || !isStamp(stamp)) {
      fail("'" + std::string(field) + "' is not a stamp in ns from 0 to " +
           std::to_string(kLastStamp));
    }
    if (rows_ > 0 && stamp <= stamp_) {
      fail("stamp " + std::to_string(stamp) + " does not come after " + std::to_string(stamp_));
    }
    stamp_ = stamp;
  }

  void parseNumber(std::string_view field) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
    if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(number)) {
      fail("'" + std::string(field) + "' is not a finite number");
    }
    numbers_.push_back(number);
  }

  std::string path_, expected_;
  std::ifstream in_;
  int line_ = 0, rows_ = 0;
  TimeNs stamp_ = 0;
  std::vector<double> numbers_;
};

Eigen::Vector3d vectorAt(const std::vector<double>& numbers, size_t i) {
  return {numbers[i], numbers[i + 1], numbers[i + 2]};
}

}  // namespace

GroundTruth readGroundTruthCsv(const std::string& path) {
  NumberFile file(path,
                  "8 or 17 columns: stamp [ns], position, quaternion (w x y z), and velocity, gyro "
                  "and accelerometer "
                  "biases");
  GroundTruth truth;
  size_t columns = 0;
  while (file.next()) {
    const std::vector<double>& n = file.numbers();
    if (columns == 0) columns = n.size();
    if ((n.size() != 7 && n.size() != 16) || n.size() != columns) {
      file.fail("found " + std::to_string(n.size() + 1) + " columns");
    }
    const Eigen::Quaterniond q(n[3], n[4], n[5], n[6]);
    if (std::abs(q.norm() - 1.0) > 0.01) file.fail("the quaternion's norm is not 1");
    GroundTruthState state;
    state.t = file.stamp();
    state.T_WB = {q.normalized().toRotationMatrix(), vectorAt(n, 0)};
    if (n.size() == 16) {
      state.v_WB = vectorAt(n, 7);
      state.b_g = vectorAt(n, 10);
      state.b_a = vectorAt(n, 13);
    }
    truth.states.push_back(state);
  }
  file.requireRows(2);
  truth.has_velocity = truth.has_biases = columns == 16;
  return truth;
}

std::vector<ImuSample> readImuCsv(const std::string& path) {
  NumberFile file(path, "7 columns: stamp [ns], angular rate [rad/s], specific force [m/s^2]");
  std::vector<ImuSample> samples;
  while (file.next()) {
    if (file.numbers().size() != 6) {
      file.fail("found " + std::to_string(file.numbers().size() + 1) + " columns");
    }
    samples.push_back({file.stamp(), vectorAt(file.numbers(), 0), vectorAt(file.numbers(), 3)});
  }
  file.requireRows(2);
  return samples;
}

std::vector<TimeNs> readStamps(const std::string& path) {
  NumberFile file(path, "one stamp [ns] a line");
  std::vector<TimeNs> stamps;
  while (file.next()) {
    if (!file.numbers().empty()) {
      file.fail("found " + std::to_string(file.numbers().size() + 1) + " columns");
    }
    stamps.push_back(file.stamp());
  }
  file.requireRows(1);
  return stamps;
}

}  // namespace etalon
