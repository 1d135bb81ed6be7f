#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <type_traits>
#include <utility>

namespace etalon {

/** Why something that may be refused is refused. */
enum class RefusalStatus {
  kTooFewKeyframes,
  kTooFewTracks,
  kTooLittleMotion,
  kImuGap,          ///< the IMU does not cover the window, or has a gap
  kInvalidInput,    ///< not finite, out of order
  kIllConditioned,  ///< the data do not determine the unknowns
  kNotConverged,
  kImplausible,    ///< a value outside what the configuration calls plausible
  kTooMuchMotion,  ///< the platform does not stand still
};

/** Lower-case name as it stands in files, e.g. "too_few_tracks". */
const char* toString(RefusalStatus status);

/** What is to be expected went wrong: an ordinary answer, made by refuse(). */
struct Refusal {
  RefusalStatus status = RefusalStatus::kInvalidInput;
  std::string reason;           ///< one clause with the numbers in it
  std::optional<double> value;  ///< the number behind it
  std::optional<double> bound;  ///< that the value does not keep
};

/** A value, or the refusal to give one. */
template <typename T>
using Expected = tl::expected<T, Refusal>;

/** A number in a reason, as it is printed. */
struct Number {
  double number = 0.0;
  std::string text;

  template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer> &&
                                                          !std::is_same_v<Integer, bool>>>
  Number(Integer n) : number(static_cast<double>(n)), text(std::to_string(n)) {}  // NOLINT
  Number(double x);  ///< four significant digits NOLINT(google-explicit-constructor)
  Number(double x, int decimals);
};

/** The number behind a refusal. */
struct Value : Number {
  template <typename... Arguments>
  explicit Value(const Arguments&... arguments) : Number(arguments...) {}
};

/** The bound that the value does not keep. */
struct Bound : Number {
  template <typename... Arguments>
  explicit Bound(const Arguments&... arguments) : Number(arguments...) {}
};

namespace detail {

void append(const std::string& text, Refusal* refusal);
void append(const Number& number, Refusal* refusal);
void append(const Value& value, Refusal* refusal);
void append(const Bound& bound, Refusal* refusal);

}  // namespace detail

/**
 * A refusal whose reason is the pieces, one after the other: texts and numbers, among them at most
 * one Value and one Bound.
 *   return refuse(RefusalStatus::kTooFewTracks, Value(n), " landmarks, at least ", Bound(least),
 *                 " are wanted");
 * What it returns converts to any Expected<T>.
 */
template <typename... Pieces>
tl::unexpected<Refusal> refuse(RefusalStatus status, const Pieces&... pieces) {
  static_assert((0 + ... + std::is_same_v<Pieces, Value>) <= 1, "a refusal has one value");
  static_assert((0 + ... + std::is_same_v<Pieces, Bound>) <= 1, "a refusal has one bound");
  Refusal refusal;
  refusal.status = status;
  (detail::append(pieces, &refusal), ...);
  return tl::unexpected<Refusal>(std::move(refusal));
}

/** Passes a refusal on: `if (!step) return refuse(step.error());` */
inline tl::unexpected<Refusal> refuse(Refusal refusal) {
  return tl::unexpected<Refusal>(std::move(refusal));
}

}  // namespace etalon
