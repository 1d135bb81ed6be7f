#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "etalon/runlog/json_reader.h"

/*
 * One statement of an object's members serves writing and reading:
 *
 *   template <typename Archive>
 *   void members(Archive& json, Member<Archive, ResidualGroup>& group) {
 *     json("chi2", group.chi2);
 *     json("dof", group.dof);
 *   }
 *
 * asJson(group) and fromJson<ResidualGroup>(reader) follow from it. nlohmann's macros do the same,
 * but they check no range, handle no NaN, and do not name the place of an error in the document.
 *
 * A double is a number or null (NaN), an int a count, an int64 a stamp in ns, a vector of Eigen an
 * array of numbers, a matrix an array of its rows, a std::vector an array; std::optional is left
 * out where it is empty.
 */

namespace etalon {

class JsonWriter;
class JsonParser;

/** The record as an archive sees it: the writer changes nothing. */
template <typename Archive, typename T>
using Member = std::conditional_t<Archive::kReads, T, const T>;

/** Makes explicit what nlohmann does by itself: a number that is not finite becomes null. */
inline nlohmann::ordered_json numberJson(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

template <typename T>
nlohmann::ordered_json asJson(const T& value);
template <typename T>
T fromJson(const JsonReader& json);

/** Writes members in the order in which they are stated. */
class JsonWriter {
 public:
  static constexpr bool kReads = false;

  template <typename T>
  void operator()(const std::string& key, const T& value) {
    json_[key] = asJson(value);
  }
  template <typename T>
  void operator()(const std::string& key, const std::optional<T>& value) {
    if (value) (*this)(key, *value);
  }
  /** Writes a member, but leaves it out where it is NaN or empty. */
  template <typename T>
  void unlessNone(const std::string& key, const T& value) {
    bool none = false;
    if constexpr (std::is_same_v<T, double>)
      none = std::isnan(value);
    else
      none = value.size() == 0;
    if (!none) (*this)(key, value);
  }
  /** A member that older files do not have. */
  template <typename T>
  void added(const std::string& key, const T& value) {
    (*this)(key, value);
  }
  /** Checks nothing, because only what was read is checked. */
  template <typename Condition>
  void expect(const std::string& /*key*/, const Condition& /*holds*/,
              const std::string& /*expectation*/) {}

  nlohmann::ordered_json take() { return std::move(json_); }

 private:
  nlohmann::ordered_json json_ = nlohmann::ordered_json::object();
};

/** Reads members; throws a DataError that names the place where a member is not as expected. */
class JsonParser {
 public:
  static constexpr bool kReads = true;
  explicit JsonParser(const JsonReader& json) : json_(json) {}

  template <typename T>
  void operator()(const std::string& key, T& value) {
    value = fromJson<T>(json_.at(key));
  }
  template <typename T>
  void operator()(const std::string& key, std::optional<T>& value) {
    if (json_.has(key)) value = fromJson<T>(json_.at(key));
  }
  template <typename T>
  void unlessNone(const std::string& key, T& value) {
    added(key, value);
  }
  template <typename T>
  void added(const std::string& key, T& value) {
    if (json_.has(key)) (*this)(key, value);
  }
  /** @throws DataError at `key` unless holds() */
  template <typename Condition>
  void expect(const std::string& key, const Condition& holds, const std::string& expectation) {
    if (!holds()) json_.at(key).fail(expectation);
  }

 private:
  const JsonReader& json_;
};

namespace detail {

template <typename T>
struct IsStdVector : std::false_type {};
template <typename T>
struct IsStdVector<std::vector<T>> : std::true_type {};

template <typename T>
constexpr bool kIsEigen = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

using TextMap = std::map<std::string, std::string>;

/** Rows of numbers; of a square matrix where T does not say how many. */
template <typename T>
T matrixFromJson(const JsonReader& json) {
  const std::vector<JsonReader> rows = json.elements();
  const Eigen::Index n = rows.size();
  if (T::RowsAtCompileTime != Eigen::Dynamic && n != T::RowsAtCompileTime)
    json.fail("expected " + std::to_string(T::RowsAtCompileTime) + " rows");
  T matrix(n, n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::vector<JsonReader> row = rows[r].elements();
    if (row.size() != rows.size()) json.fail("expected a square matrix");
    for (Eigen::Index c = 0; c < n; ++c) matrix(r, c) = row[c].number();
  }
  return matrix;
}

}  // namespace detail

template <typename T>
nlohmann::ordered_json asJson(const T& value) {
  if constexpr (std::is_same_v<T, double>) {
    return numberJson(value);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    return value;
  } else if constexpr (std::is_same_v<T, detail::TextMap>) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const auto& [key, text] : value) json[key] = text;
    return json;
  } else if constexpr (detail::IsStdVector<T>::value) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const auto& element : value) json.push_back(asJson(element));
    return json;
  } else if constexpr (detail::kIsEigen<T>) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (Eigen::Index i = 0; i < value.rows(); ++i) {
      if constexpr (T::ColsAtCompileTime == 1)
        json.push_back(numberJson(value(i)));
      else
        json.push_back(asJson(Eigen::VectorXd(value.row(i))));
    }
    return json;
  } else {
    JsonWriter writer;
    members(writer, value);
    return writer.take();
  }
}

template <typename T>
T fromJson(const JsonReader& json) {
  if constexpr (std::is_same_v<T, double>) {
    return json.number();
  } else if constexpr (std::is_same_v<T, bool>) {
    return json.boolean();
  } else if constexpr (std::is_same_v<T, int> || std::is_same_v<T, std::size_t>) {
    return json.count();
  } else if constexpr (std::is_same_v<T, TimeNs>) {
    return json.stamp();
  } else if constexpr (std::is_same_v<T, std::string>) {
    return json.text();
  } else if constexpr (std::is_same_v<T, detail::TextMap>) {
    T value;
    for (const std::string& key : json.keys()) value[key] = json.at(key).text();
    return value;
  } else if constexpr (detail::IsStdVector<T>::value) {
    T value;
    for (const JsonReader& element : json.elements())
      value.push_back(fromJson<typename T::value_type>(element));
    return value;
  } else if constexpr (detail::kIsEigen<T>) {
    if constexpr (T::ColsAtCompileTime == 1)
      return json.vector<T::RowsAtCompileTime>();
    else
      return detail::matrixFromJson<T>(json);
  } else {
    T value;
    JsonParser parser(json);
    members(parser, value);
    return value;
  }
}

}  // namespace etalon
