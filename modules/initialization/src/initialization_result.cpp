#include "etalon/initialization/initialization_result.h"

namespace etalon {
InitializationResult InitializationResult::refusal(InitializationStatus status, std::string reason,
                                                   double value) {
  InitializationResult r;
  r.status = status;
  r.reason = std::move(reason);
  r.reason_value = value;
  return r;
}
}  // namespace etalon
