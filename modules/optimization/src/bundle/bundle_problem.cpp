#include "etalon/optimization/bundle/bundle_problem.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/statistics.h"

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

std::vector<double> BundleProblem::squaredResiduals(const std::vector<SE3>& T_WB) const {
  std::vector<double> squares;
  for (size_t l = 0; l < landmarks.size(); ++l) {
    double inliers = 0.0;
    for (const VisualMeasurement& m : window.measurementsOf(l)) inliers += m.inlier;
    const double share = (2.0 * inliers - 3.0) / (2.0 * inliers);
    for (const VisualMeasurement& m : window.measurementsOf(l)) {
      Eigen::Vector2d r;
      if (m.inlier && window.residual(m, T_WB, landmarks[l].position, &r))
        squares.push_back(r.squaredNorm() / share);
    }
  }
  return squares;
}

double BundleProblem::medianNoise(const std::vector<SE3>& T_WB) const {
  constexpr double kMedianChi2 = 1.386;  // of chi-square with 2 degrees of freedom
  std::vector<double> squares = squaredResiduals(T_WB);
  return squares.empty() ? 1.0 : std::sqrt(median(std::move(squares)) / kMedianChi2);
}

double BundleProblem::trimmedNoise(const std::vector<SE3>& T_WB) const {
  const std::vector<double> squares = squaredResiduals(T_WB);
  if (squares.empty()) return 1.0;
  return std::sqrt(0.5 * meanUpTo(kOutlyingSquare * median(squares), squares));
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
