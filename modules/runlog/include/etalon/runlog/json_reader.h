#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/time.h"

namespace etalon {

/** A node of a JSON document that knows its place, so that messages can name it. */
class JsonReader {
 public:
  /** @param document stands for the text in messages; `json` must outlive the reader. */
  JsonReader(const nlohmann::json& json, std::string document)
      : json_(&json), document_(std::move(document)) {}

  bool has(const std::string& key) const { return json_->is_object() && json_->contains(key); }

  JsonReader at(const std::string& key) const {
    if (!has(key)) fail("expected an object with the key '" + key + "'");
    return {json_->at(key), document_, place_ + "/" + key};
  }
  std::vector<JsonReader> elements() const {
    if (!json_->is_array()) fail("expected an array");
    std::vector<JsonReader> result;
    for (size_t i = 0; i < json_->size(); ++i)
      result.push_back({json_->at(i), document_, place_ + "/" + std::to_string(i)});
    return result;
  }
  std::vector<std::string> keys() const {
    if (!json_->is_object()) fail("expected an object");
    std::vector<std::string> result;
    for (const auto& item : json_->items()) result.push_back(item.key());
    return result;
  }

  std::string text() const {
    if (!json_->is_string()) fail("expected a text");
    return json_->get<std::string>();
  }
  bool boolean() const {
    if (!json_->is_boolean()) fail("expected true or false");
    return json_->get<bool>();
  }
  /** null is NaN. */
  double number() const {
    if (json_->is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!json_->is_number()) fail("expected a number or null");
    return json_->get<double>();
  }
  TimeNs integer() const {
    // An unsigned number beyond the type would wrap; what is beyond that, too, is no integer.
    if (!json_->is_number_integer() ||
        (json_->is_number_unsigned() && json_->get<std::uint64_t>() > kLargest))
      fail("expected an integer");
    return json_->get<TimeNs>();
  }
  TimeNs stamp() const {
    const TimeNs value = integer();
    if (!isStamp(value)) fail("expected a stamp in ns from 0 to " + std::to_string(kLastStamp));
    return value;
  }
  int count() const {
    const TimeNs value = integer();
    if (value < 0 || value > std::numeric_limits<int>::max())
      fail("expected a count, a whole number from 0 to 2147483647");
    return static_cast<int>(value);
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector() const {
    if (!json_->is_array() || json_->size() != N)
      fail("expected " + std::to_string(N) + " numbers");
    Eigen::Matrix<double, N, 1> result;
    const std::vector<JsonReader> numbers = elements();
    for (int i = 0; i < N; ++i) result[i] = numbers[i].number();
    return result;
  }

  [[noreturn]] void fail(const std::string& expectation) const {
    throw DataError(document_, 0,
                    "in the JSON at '" + (place_.empty() ? "/" : place_) + "': " + expectation);
  }

 private:
  static constexpr std::uint64_t kLargest = std::numeric_limits<TimeNs>::max();

  JsonReader(const nlohmann::json& json, std::string document, std::string place)
      : json_(&json), document_(std::move(document)), place_(std::move(place)) {}

  const nlohmann::json* json_;
  std::string document_;
  std::string place_;  ///< as a JSON pointer
};

}  // namespace etalon
