#include "etalon/pipeline/pipeline_state.h"

namespace etalon {

const char* toString(PipelineState state) {
  switch (state) {
    case PipelineState::kWaiting:
      return "waiting";
    case PipelineState::kVisual:
      return "visual";
    case PipelineState::kInertial:
      return "inertial";
    case PipelineState::kDeadReckoning:
      return "dead_reckoning";
    case PipelineState::kLost:
      return "lost";
  }
  return "unknown";
}

}  // namespace etalon
