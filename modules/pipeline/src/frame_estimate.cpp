#include "etalon/pipeline/frame_estimate.h"

namespace etalon {

Trajectory trajectoryOf(const std::vector<FrameEstimate>& estimates) {
  Trajectory trajectory;
  for (const FrameEstimate& estimate : estimates)
    trajectory.push_back({estimate.t, estimate.nav.T_WB});
  return trajectory;
}

}  // namespace etalon
