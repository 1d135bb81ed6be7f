#include "corrected.h"

#include <algorithm>

#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"

namespace etalon::ground_truth {
namespace {

/** States at the IMU's stamps from node `a` on and before node `b`. */
void addBetween(const Node& a, const Node& b, const Eigen::Vector3d& g_G, const ImuBuffer& imu,
                std::vector<StampedState>* states) {
  const auto samples = imu.between(a.body.t, b.body.t);
  if (samples.size() < 2) return;
  std::vector<StampedState> carried = {a.body};
  for (size_t i = 1; i < samples.size(); ++i) {
    const Preintegration step({samples[i - 1], samples[i]}, a.body.bias, {});
    carried.emplace_back(samples[i].t, step.predict(carried.back(), g_G));
  }
  const Eigen::Matrix<double, 15, 1> missed = b.body.minus(carried.back());
  // The first and the last sample were made at the nodes' stamps, which need not be the IMU's.
  const auto recorded = [&imu](TimeNs t) {
    const auto& all = imu.samples();
    const auto at = std::lower_bound(all.begin(), all.end(), t,
                                     [](const ImuSample& s, TimeNs time) { return s.t < time; });
    return at != all.end() && at->t == t;
  };
  for (size_t i = 0; i + 1 < carried.size(); ++i) {
    if (i == 0 && !recorded(carried[i].t)) continue;
    const double share =
        secondsBetween(a.body.t, carried[i].t) / secondsBetween(a.body.t, b.body.t);
    states->emplace_back(carried[i].t, carried[i].plus(share * missed));
  }
}

}  // namespace

GroundTruth correctedStates(const std::vector<Node>& nodes, const Shared& shared,
                            const ImuBuffer& imu, double max_gap_s) {
  GroundTruth truth;
  truth.has_velocity = truth.has_biases = true;
  for (size_t k = 0; k + 1 < nodes.size(); ++k)
    if (secondsBetween(nodes[k].body.t, nodes[k + 1].body.t) <= max_gap_s)
      addBetween(nodes[k], nodes[k + 1], shared.g_G, imu, &truth.states);
  const Eigen::Matrix3d R_WG = rotationBetween(shared.g_G, -Eigen::Vector3d::UnitZ());
  for (StampedState& state : truth.states) {
    state.T_WB = SE3(R_WG, Eigen::Vector3d::Zero()) * state.T_WB;
    state.v_WB = R_WG * state.v_WB;
  }
  return truth;
}

}  // namespace etalon::ground_truth
