#include "etalon/core/refusal.h"

#include "etalon/core/text.h"

namespace etalon {

const char* toString(RefusalStatus status) {
  switch (status) {
    case RefusalStatus::kTooFewKeyframes:
      return "too_few_keyframes";
    case RefusalStatus::kTooFewTracks:
      return "too_few_tracks";
    case RefusalStatus::kTooLittleMotion:
      return "too_little_motion";
    case RefusalStatus::kImuGap:
      return "imu_gap";
    case RefusalStatus::kInvalidInput:
      return "invalid_input";
    case RefusalStatus::kIllConditioned:
      return "ill_conditioned";
    case RefusalStatus::kNotConverged:
      return "not_converged";
    case RefusalStatus::kImplausible:
      return "implausible";
    case RefusalStatus::kTooMuchMotion:
      return "too_much_motion";
  }
  return "unknown";
}

Number::Number(double x) : number(x), text(format("%.4g", x)) {}

Number::Number(double x, int decimals) : number(x), text(format("%.*f", decimals, x)) {}

namespace detail {

void append(const std::string& text, Refusal* refusal) { refusal->reason += text; }

void append(const Number& number, Refusal* refusal) { refusal->reason += number.text; }

void append(const Value& value, Refusal* refusal) {
  refusal->reason += value.text;
  refusal->value = value.number;
}

void append(const Bound& bound, Refusal* refusal) {
  refusal->reason += bound.text;
  refusal->bound = bound.number;
}

}  // namespace detail
}  // namespace etalon
