#include "etalon/optimization/bundle/bundle_problem.h"

#include <algorithm>

namespace etalon {

BundleProblem::BundleProblem(VisualWindow visual_window,
                             const std::map<LandmarkId, Eigen::Vector3d>& known)
    : window(std::move(visual_window)), landmarks(window.landmark_ids.size()) {
  for (size_t l = 0; l < landmarks.size(); ++l) {
    const auto found = known.find(window.landmark_ids[l]);
    if (found != known.end()) landmarks[l] = {found->second, true, false};
  }
}

void BundleProblem::triangulateMissing(const std::vector<SE3>& T_WB) {
  for (int l = 0; l < window.landmarkCount(); ++l) {
    BundleLandmark& landmark = landmarks[l];
    if (landmark.known) continue;
    if (const auto p_W = triangulate(window, l, T_WB)) landmark = {*p_W, true, false};
  }
}

double BundleProblem::relabel(const std::vector<SE3>& T_WB, double chi2_threshold) {
  double sum = 0.0;
  for (size_t l = 0; l < landmarks.size(); ++l) {
    BundleLandmark& landmark = landmarks[l];
    int count = 0;
    double landmark_sum = 0.0;
    for (VisualMeasurement& m : window.measurementsOf(l)) {
      Eigen::Vector2d r;
      m.inlier = landmark.known && window.residual(m, T_WB, landmark.position, &r) &&
                 r.squaredNorm() < chi2_threshold;
      if (!m.inlier) continue;
      landmark_sum += r.squaredNorm();
      ++count;
    }
    landmark.valid = count >= 2;
    if (landmark.valid)
      sum += landmark_sum;
    else
      for (VisualMeasurement& m : window.measurementsOf(l)) m.inlier = false;
  }
  return sum;
}

int BundleProblem::inlierCount() const {
  return std::count_if(window.measurements.begin(), window.measurements.end(),
                       [](const VisualMeasurement& m) { return m.inlier; });
}

std::map<LandmarkId, Eigen::Vector3d> BundleProblem::validLandmarks() const {
  std::map<LandmarkId, Eigen::Vector3d> valid;
  for (size_t l = 0; l < landmarks.size(); ++l)
    if (landmarks[l].valid) valid[window.landmark_ids[l]] = landmarks[l].position;
  return valid;
}

}  // namespace etalon
