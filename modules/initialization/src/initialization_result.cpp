#include "etalon/initialization/initialization_result.h"

#include <cstdio>
#include <utility>

namespace etalon {

const char* toString(InitializationStatus status) {
  switch (status) {
    case InitializationStatus::kSuccess:
      return "success";
    case InitializationStatus::kTooFewKeyframes:
      return "too_few_keyframes";
    case InitializationStatus::kTooFewTracks:
      return "too_few_tracks";
    case InitializationStatus::kTooLittleMotion:
      return "too_little_motion";
    case InitializationStatus::kImuGap:
      return "imu_gap";
    case InitializationStatus::kInvalidInput:
      return "invalid_input";
    case InitializationStatus::kIllConditioned:
      return "ill_conditioned";
    case InitializationStatus::kNotConverged:
      return "not_converged";
    case InitializationStatus::kImplausible:
      return "implausible";
    case InitializationStatus::kTooMuchMotion:
      return "too_much_motion";
  }
  return "unknown";
}

InitializationResult InitializationResult::refusal(InitializationStatus status, std::string reason,
                                                   double value) {
  InitializationResult result;
  result.status = status;
  result.reason = std::move(reason);
  result.reason_value = value;
  return result;
}

InitializationResult InitializationResult::refusal(InitializationStatus status, const char* format,
                                                   double value, double bound) {
  char text[256];
  std::snprintf(text, sizeof text, format, value, bound);
  return refusal(status, text, value);
}

}  // namespace etalon
