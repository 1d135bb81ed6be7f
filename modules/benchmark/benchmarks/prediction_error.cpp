#include "prediction_error.h"

#include <limits>
#include <set>

namespace etalon {

namespace {

/** Landmark `l` alone, without the measurements of keyframe `left_out`; empty if fewer than two
 * keyframes are left. */
VisualWindow without(const VisualWindow& window, size_t l, int left_out) {
  VisualWindow rest;
  rest.T_CB = window.T_CB;
  rest.keyframe_count = window.keyframe_count;
  std::set<int> keyframes;
  for (int i = window.first[l]; i < window.first[l + 1]; ++i) {
    const VisualMeasurement& m = window.measurements[i];
    if (m.keyframe == left_out) continue;
    rest.measurements.push_back(m);
    rest.measurements.back().landmark = 0;
    keyframes.insert(m.keyframe);
  }
  if (keyframes.size() < 2) return {};
  rest.landmark_ids = {window.landmark_ids[l]};
  rest.first = {0, static_cast<int>(rest.measurements.size())};
  return rest;
}

}  // namespace

std::vector<double> predictionErrors(const VisualWindow& window, double sigma_px,
                                     const std::vector<SE3>& T_WB) {
  std::vector<double> errors(window.measurements.size(), std::numeric_limits<double>::quiet_NaN());
  std::optional<Eigen::Vector3d> p_W;  // from the other keyframes
  for (size_t i = 0; i < window.measurements.size(); ++i) {
    const VisualMeasurement& m = window.measurements[i];
    const VisualMeasurement* before = i > 0 ? &window.measurements[i - 1] : nullptr;
    if (!before || before->landmark != m.landmark || before->keyframe != m.keyframe) {
      const VisualWindow rest = without(window, m.landmark, m.keyframe);
      p_W = rest.landmark_ids.empty() ? std::nullopt : triangulate(rest, 0, T_WB);
    }
    Eigen::Vector2d r;
    if (p_W &&
        reprojectionResidual(window.T_CB[m.camera], m.measurement, T_WB[m.keyframe], *p_W, &r))
      errors[i] = sigma_px * r.norm();
  }
  return errors;
}

}  // namespace etalon
